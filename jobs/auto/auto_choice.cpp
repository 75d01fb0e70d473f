#include "jobs/auto/auto_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/job/text/job_fields.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

/// What a more complicated candidate must gain.
constexpr double kGain = 1.05;

/// The second pass keeps two halves of everything.
bool can_take(const AutoCandidate& candidate, int num_particles) {
  return !candidate.correlated || num_particles % 2 == 0;
}

/// Whether the job may have the candidate's method: its AOVs, catchers, thresholds and so on may
/// exclude one.
bool suits(const JobSpec& job, const AutoCandidate& candidate) {
  JobSpec with = job;
  with.sampling = candidate.sampling;
  with.visibility.correlated = candidate.correlated;
  return static_cast<bool>(parse_job(to_json(with), "", "/"));
}

/// A family at some N.
struct Option {
  AutoCandidate candidate;
  double error = 0, cost_us = 0;
};

/// log y at log n on the line through the first and the last of the points.
double interpolate(std::span<const PilotNumbers> points, double PilotNumbers::*y, int n) {
  const PilotNumbers& a = points.front();
  const PilotNumbers& b = points.back();
  const double at = std::log(a.candidate.sampling.num_particles);
  const double span = std::log(b.candidate.sampling.num_particles) - at;
  const double share = span > 0 ? (std::log(n) - at) / span : 0;
  const double low = std::log(std::max(a.*y, 1e-12)), high = std::log(std::max(b.*y, 1e-12));
  return std::exp(low + share * (high - low));
}

/// Everything that may be chosen, family by family, simplest first, with what is expected of it.
std::vector<Option> options_of(const SamplingSpec& asked, std::span<const PilotNumbers> pilot) {
  std::vector<Option> options;
  for (std::size_t first = 0; first < pilot.size();) {
    std::size_t last = first + 1;
    while (last < pilot.size() && pilot[last].candidate.family == pilot[first].candidate.family)
      ++last;
    const auto family = pilot.subspan(first, last - first);
    first = last;
    if (!chooses_particles(asked)) {
      for (const PilotNumbers& seen : family)
        options.push_back({seen.candidate, seen.error, seen.cost_us});
      continue;
    }
    for (const int n : kParticlesToChoose) {
      if (!can_take(family.front().candidate, n)) continue;
      AutoCandidate candidate = family.front().candidate;
      candidate.sampling.num_particles = n;
      candidate.sampling.num_candidates = std::max(candidate.sampling.num_candidates, n);
      options.push_back({candidate, interpolate(family, &PilotNumbers::error, n),
                         interpolate(family, &PilotNumbers::cost_us, n)});
    }
  }
  return options;
}

/// The first option that none with `score` higher by kGain follows; only those that `allowed`.
template <class Allowed, class Score>
const Option* best_option(const std::vector<Option>& options, Allowed allowed, Score score) {
  const Option* best = nullptr;
  for (const Option& option : options) {
    if (!allowed(option)) continue;
    // Within a family there is no order of simplicity.
    const bool same = best != nullptr && best->candidate.family == option.candidate.family;
    if (best == nullptr || score(option) > score(*best) * (same ? 1.0 : kGain)) best = &option;
  }
  return best;
}

double efficiency(const Option& option) {
  return 1 / std::max(option.error * option.error * option.cost_us, 1e-30);
}

AutoChoice choice_of(const Option& option, std::string reason) {
  return {option.candidate.sampling, option.candidate.correlated, option.error, option.cost_us,
          std::move(reason)};
}

}  // namespace

bool chooses_particles(const SamplingSpec& asked) {
  return asked.target_error.has_value() || asked.time_budget.has_value();
}

std::string AutoCandidate::name() const {
  return fmt::format("{} N={}", family, sampling.num_particles);
}

std::vector<AutoCandidate> auto_candidates(const JobSpec& job) {
  std::vector<AutoCandidate> candidates;
  const auto add = [&](const std::string& family, Method method, int num_candidates,
                       int num_distributions, bool correlated = false) {
    const auto add_one = [&](int n) {
      AutoCandidate candidate{family, job.sampling, correlated || job.visibility.correlated};
      candidate.sampling.method = method;
      candidate.sampling.num_particles = n;
      candidate.sampling.num_candidates = std::max(num_candidates, n);
      candidate.sampling.num_distributions = num_distributions;
      candidate.sampling.mis_compensation =
          job.sampling.mis_compensation && traits(method).compensates;
      candidate.sampling.target_error.reset();
      candidate.sampling.time_budget.reset();
      if (can_take(candidate, n) && suits(job, candidate))
        candidates.push_back(std::move(candidate));
    };
    if (!chooses_particles(job.sampling)) return add_one(job.sampling.num_particles);
    for (const int n : kPilotParticles) add_one(n);
  };
  const SamplingSpec& asked = job.sampling;
  add("brdf", Method::brdf, asked.num_candidates, asked.num_distributions);
  add("environment", Method::environment, asked.num_candidates, asked.num_distributions);
  add("mis", Method::mis, asked.num_candidates, asked.num_distributions);
  for (const int m : {64, 128, 512})
    add(fmt::format("bidirectional M={}", m), Method::bidirectional, m, asked.num_distributions);
  if (!job.visibility.correlated)
    add("bidirectional M=128 with second pass", Method::bidirectional, 128, asked.num_distributions,
        true);
  if (job.frames.size() > 1 && job.state.carry) {
    for (const int p : {1, 5})
      add(fmt::format("sequential P={}", p), Method::sequential, asked.num_candidates, p);
    for (const int m : {64, 128, 256, 512})
      add(fmt::format("pool M={}", m), Method::pool, m, asked.num_distributions);
  }
  return candidates;
}

AutoChoice choose_sampling(const JobSpec& job, std::span<const PilotNumbers> pilot,
                           double lit_pixels) {
  BATON_CHECK(!pilot.empty());
  const std::vector<Option> options = options_of(job.sampling, pilot);
  const auto any = [](const Option&) { return true; };
  const auto accuracy = [](const Option& o) { return 1 / std::max(o.error, 1e-12); };

  if (job.sampling.target_error) {
    const double target = *job.sampling.target_error;
    const auto reaches = [&](const Option& o) { return o.error <= target; };
    const auto cheapness = [](const Option& o) { return 1 / o.cost_us; };
    if (const Option* best = best_option(options, reaches, cheapness))
      return choice_of(*best,
                       fmt::format("the cheapest that reaches the target error {:g}", target));
    return choice_of(*best_option(options, any, accuracy),
                     fmt::format("none reaches the target error {:g}: the most accurate", target));
  }
  if (job.sampling.time_budget) {
    const double budget = *job.sampling.time_budget;
    const auto fits = [&](const Option& o) { return o.cost_us * 1e-6 * lit_pixels <= budget; };
    if (const Option* best = best_option(options, fits, accuracy))
      return choice_of(*best, fmt::format("the most accurate within {:g} s", budget));
    const auto cheapness = [](const Option& o) { return 1 / o.cost_us; };
    return choice_of(*best_option(options, any, cheapness),
                     fmt::format("none fits into {:g} s: the cheapest", budget));
  }
  return choice_of(
      *best_option(options, any, efficiency),
      fmt::format("the best 1 / (error^2 x cost) at N = {}", job.sampling.num_particles));
}

void apply_choice(const AutoChoice& choice, std::span<const PilotNumbers> pilot, JobSpec& job) {
  std::string seen;
  for (const PilotNumbers& numbers : pilot) {
    fmt::format_to(std::back_inserter(seen), "{}{}: error {:.4f}, {:.2f} us",
                   seen.empty() ? "" : "; ", numbers.candidate.name(), numbers.error,
                   numbers.cost_us);
  }
  job.metadata[kAutoChoice] =
      fmt::format("{}{} N={} M={} P={}: expected error {:.4f}, {:.2f} us per pixel and frame",
                  traits(choice.sampling.method).name, choice.correlated ? " with second pass" : "",
                  choice.sampling.num_particles, choice.sampling.num_candidates,
                  choice.sampling.num_distributions, choice.error, choice.cost_us);
  job.metadata["auto.reason"] = choice.reason;
  job.metadata["auto.pilot"] = seen.substr(0, limits::kMaxTextLength);
  job.sampling = choice.sampling;
  job.visibility.correlated = choice.correlated;
}

}  // namespace baton
