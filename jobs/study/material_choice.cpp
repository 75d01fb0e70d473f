#include "jobs/study/material_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "common/base/limits.h"
#include "common/job/job_fields.h"

namespace baton {
namespace {

/// What a setting of its own must gain.
constexpr double kGain = 1.05;
/// Past so many materials, further ones stay with the base.
constexpr std::size_t kMaxVaried = 32;

/// A setting that a material may take.
struct Option {
  SamplingSpec sampling;
  std::vector<double> square;  ///< (materials)
  double cost_us = 0;
};

/// What a picture's squared errors, cost and rays add up to.
struct Sums {
  double square = 0, cost_us = 0, rays = 0;
};

/// y at n on the line through (na, a) and (nb, b), all in logarithms.
double interpolate(int na, double a, int nb, double b, int n) {
  const double share = na == nb ? 0 : std::log(1.0 * n / na) / std::log(1.0 * nb / na);
  const double low = std::log(std::max(a, 1e-15)), high = std::log(std::max(b, 1e-15));
  return std::exp(low + share * (high - low));
}

/// What lies between the fewest and the most particles of a family.
void add_interpolated(std::span<const MaterialNumbers> family, std::vector<Option>& options) {
  const MaterialNumbers& a = family.front();
  const MaterialNumbers& b = family.back();
  const int na = a.candidate.sampling.num_particles, nb = b.candidate.sampling.num_particles;
  for (const int n : kParticlesToChoose) {
    Option option{a.candidate.sampling, {}, interpolate(na, a.cost_us, nb, b.cost_us, n)};
    option.sampling.num_particles = n;
    option.sampling.num_candidates = std::max(option.sampling.num_candidates, n);
    for (std::size_t k = 0; k < a.square.size(); ++k)
      option.square.push_back(interpolate(na, a.square[k], nb, b.square[k], n));
    options.push_back(std::move(option));
  }
}

std::vector<Option> options_of(const SamplingSpec& asked, std::span<const MaterialNumbers> pilot) {
  std::vector<Option> options;
  for (std::size_t first = 0, last = 0; first < pilot.size(); first = last) {
    while (last < pilot.size() && pilot[last].candidate.family == pilot[first].candidate.family)
      ++last;
    if (chooses_particles(asked)) {
      add_interpolated(pilot.subspan(first, last - first), options);
      continue;
    }
    for (const MaterialNumbers& seen : pilot.subspan(first, last - first))
      options.push_back({seen.candidate.sampling, seen.square, seen.cost_us});
  }
  return options;
}

/// The rules of choose_sampling for a whole picture: a score to be made small, infinite where it
/// must not be.
class Judge {
 public:
  Judge(const JobSpec& job, double lit_pixels) : asked_(job.sampling), lit_pixels_(lit_pixels) {}

  double operator()(const Sums& whole) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (asked_.target_error) {
      const double target = *asked_.target_error;
      return whole.square <= target * target ? whole.cost_us : kNever;
    }
    if (asked_.time_budget) {
      const bool fits = whole.cost_us * 1e-6 * lit_pixels_ <= *asked_.time_budget;
      return fits ? whole.square : kNever;
    }
    const bool fits = whole.rays <= asked_.num_particles * (1 + 1e-9);
    return fits ? whole.square * whole.cost_us : kNever;
  }

 private:
  const SamplingSpec& asked_;
  double lit_pixels_;
};

/// An option for each material, improved step by step.
class Assignment {
 public:
  /// All alike. materials, options: must outlive the object.
  Assignment(std::span<const SeenMaterial> materials, const std::vector<Option>& options,
             std::size_t base)
      : materials_(materials), options_(options), choice_(materials.size(), base) {
    for (std::size_t k = 0; k < materials.size(); ++k) add(k, base, 1, sums_);
  }

  const std::vector<std::size_t>& choice() const { return choice_; }
  const Sums& sums() const { return sums_; }

  /// The sums with another option for materials k and l, which may be one.
  Sums with(std::size_t k, std::size_t option_k, std::size_t l, std::size_t option_l) const {
    Sums sums = sums_;
    add(k, choice_[k], -1, sums);
    add(k, option_k, 1, sums);
    if (l == k) return sums;
    add(l, choice_[l], -1, sums);
    add(l, option_l, 1, sums);
    return sums;
  }
  void take(std::size_t k, std::size_t option) {
    sums_ = with(k, option, k, option);
    choice_[k] = option;
  }

  /// Takes the best options for two materials at once; returns whether that is better.
  bool improve(std::size_t k, std::size_t l, const Judge& judge) {
    std::size_t best_k = choice_[k], best_l = choice_[l];
    double best = judge(sums_);
    for (std::size_t a = 0; a < options_.size(); ++a) {
      for (std::size_t b = 0; b < options_.size(); ++b) {
        const double score = judge(with(k, a, l, b));
        if (!(score < best * (1 - kNoise))) continue;
        best = score;
        best_k = a;
        best_l = b;
      }
    }
    const bool better = best_k != choice_[k] || best_l != choice_[l];
    take(k, best_k);
    take(l, best_l);
    return better;
  }

 private:
  /// Differences of this share are rounding.
  static constexpr double kNoise = 1e-9;

  void add(std::size_t k, std::size_t option, double sign, Sums& sums) const {
    const Option& o = options_[option];
    sums.square += sign * o.square[k];
    sums.cost_us += sign * materials_[k].share * o.cost_us;
    sums.rays += sign * materials_[k].share * o.sampling.num_particles;
  }

  std::span<const SeenMaterial> materials_;
  const std::vector<Option>& options_;
  std::vector<std::size_t> choice_;
  Sums sums_;
};

/// Improves pair by pair until no pair can: one material may give the rays that another one needs.
void improve_pairs(std::size_t num_materials, const Judge& judge, Assignment& assignment) {
  constexpr int kMaxRounds = 8;
  bool better = true;
  for (int round = 0; round < kMaxRounds && better; ++round) {
    better = false;
    for (std::size_t k = 0; k < num_materials; ++k) {
      for (std::size_t l = k + 1; l < num_materials; ++l)
        better = assignment.improve(k, l, judge) || better;
    }
  }
}

}  // namespace

std::string MaterialChoice::name(std::span<const SeenMaterial> materials) const {
  std::string text;
  for (std::size_t k = 0; k < materials.size(); ++k) {
    const SamplingSpec& s = sampling[k];
    fmt::format_to(std::back_inserter(text), "{}{} {} N={}", k > 0 ? " + " : "", materials[k].name,
                   traits(s.method).name, s.num_particles);
    if (s.method == Method::bidirectional)
      fmt::format_to(std::back_inserter(text), " M={}", s.num_candidates);
  }
  return text;
}

std::vector<int> material_particles(const SamplingSpec& asked) {
  if (chooses_particles(asked)) return {std::begin(kPilotParticles), std::end(kPilotParticles)};
  const int n = asked.num_particles;
  std::vector<int> counts{std::max(n / 2, 1), n, std::min(2 * n, limits::kMaxParticles)};
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  return counts;
}

std::optional<MaterialChoice> choose_by_material(const JobSpec& job,
                                                 std::span<const SeenMaterial> materials,
                                                 std::span<const MaterialNumbers> pilot,
                                                 const SamplingSpec& base, double lit_pixels) {
  const std::vector<Option> options = options_of(job.sampling, pilot);
  const auto common = std::find_if(options.begin(), options.end(),
                                   [&](const Option& option) { return option.sampling == base; });
  if (common == options.end()) return std::nullopt;
  const auto base_index = static_cast<std::size_t>(common - options.begin());
  const Judge judge(job, lit_pixels);

  // Improve, then go back to the base wherever departing from it gains little.
  Assignment best(materials, options, base_index);
  improve_pairs(std::min(materials.size(), kMaxVaried), judge, best);
  for (std::size_t k = 0; k < materials.size(); ++k) {
    if (judge(best.with(k, base_index, k, base_index)) <= judge(best.sums()) * kGain)
      best.take(k, base_index);
  }
  const std::vector<std::size_t>& choice = best.choice();
  const bool departs =
      std::any_of(choice.begin(), choice.end(), [&](std::size_t o) { return o != base_index; });
  if (!departs || !std::isfinite(judge(best.sums()))) return std::nullopt;
  MaterialChoice result{{}, std::sqrt(best.sums().square), best.sums().cost_us};
  for (const std::size_t option : choice) result.sampling.push_back(options[option].sampling);
  return result;
}

}  // namespace baton
