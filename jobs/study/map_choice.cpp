#include "jobs/study/map_choice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/base/check.h"

namespace baton {
namespace {

/// Standard errors on either side: about 1 % with eight seeds and more.
constexpr double kLimit = 3;
constexpr double kMeanShare = 0.001;
constexpr int kMinWidth = 64;

double product(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double{a[i]} * b[i];
  return sum / static_cast<double>(a.size());
}

/// Standard error of the mean of values.
double error_of_mean(std::span<const double> values, double mean) {
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  const auto n = static_cast<double>(values.size());
  return std::sqrt(sum / (n * (n - 1)));
}

}  // namespace

SystematicDifference systematic_difference(std::span<const std::vector<float>> differences,
                                           double mean_radiance) {
  const std::size_t num_seeds = differences.size();
  BATON_CHECK(num_seeds >= 3 && mean_radiance > 0 && !differences.front().empty());

  // Products of different seeds: by seed, and of all.
  std::vector<double> with_others(num_seeds), means;
  double all = 0;
  for (std::size_t s = 0; s < num_seeds; ++s) {
    for (std::size_t t = 0; t < s; ++t) {
      const double both = product(differences[s], differences[t]);
      with_others[s] += both;
      with_others[t] += both;
      all += 2 * both;
    }
    double sum = 0;
    for (const float value : differences[s]) sum += value;
    means.push_back(sum / static_cast<double>(differences[s].size()));
  }

  // Leave out each seed in turn.
  const auto n = static_cast<double>(num_seeds);
  std::vector<double> without;
  double mean_without = 0, mean = 0;
  for (std::size_t s = 0; s < num_seeds; ++s) {
    without.push_back((all - 2 * with_others[s]) / ((n - 1) * (n - 2)));
    mean_without += without.back() / n;
    mean += means[s] / n;
  }
  const double scale = 1 / (mean_radiance * mean_radiance);
  return {all / (n * (n - 1)) * scale, error_of_mean(without, mean_without) * (n - 1) * scale,
          mean / mean_radiance, error_of_mean(means, mean) / mean_radiance};
}

double difference_limit(const SystematicDifference& seen) {
  return std::sqrt(std::max(seen.square + kLimit * seen.square_error, 0.0));
}

MapVerdict judge_map(const SystematicDifference& seen, double error) {
  const double allowed = kMapShare * error;
  const double mean = std::abs(seen.mean);
  const bool shifts = mean > kLimit * seen.mean_error && mean > kMeanShare;
  if (shifts || seen.square - kLimit * seen.square_error > allowed * allowed)
    return MapVerdict::harmful;
  return difference_limit(seen) <= allowed ? MapVerdict::harmless : MapVerdict::open;
}

std::vector<int> coarser_widths(int width) {
  std::vector<int> widths;
  for (width /= 2; width >= kMinWidth; width /= 2) widths.insert(widths.begin(), width);
  return widths;
}

Result<std::optional<int>> coarsest_harmless(
    std::span<const int> widths, const std::function<Result<bool>(int width)>& is_harmless) {
  // Those below `low` are harmful, those from `high` on harmless; the map as it is comes last.
  std::size_t low = 0, high = widths.size();
  for (std::size_t next = 0; low < high; next = (low + high) / 2) {
    BATON_ASSIGN(const bool harmless, is_harmless(widths[next]));
    if (harmless) {
      high = next;
    } else {
      low = next + 1;
    }
  }
  if (high == widths.size()) return std::optional<int>();
  return std::optional<int>(widths[high]);
}

}  // namespace baton
