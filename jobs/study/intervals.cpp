#include "jobs/study/intervals.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "common/math/philox.h"

namespace baton {
namespace {

constexpr std::uint32_t kResamples = 1000;
constexpr double kTail = 0.025;

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Mean of as many values, drawn with repetition. stream: tells the sets of a ratio apart.
double resampled_mean(std::span<const double> values, std::uint32_t resample,
                      std::uint32_t stream) {
  double sum = 0;
  for (std::uint32_t i = 0; i < values.size(); ++i) {
    const auto bits = Philox4x32::block({i, resample, stream, 0}, 0);
    sum += values[static_cast<std::size_t>((std::uint64_t{bits[0]} * values.size()) >> 32)];
  }
  return sum / static_cast<double>(values.size());
}

Interval interval_of(double value, std::vector<double> resampled) {
  std::sort(resampled.begin(), resampled.end());
  const auto at = [&](double share) {
    return resampled[static_cast<std::size_t>(share * static_cast<double>(resampled.size() - 1) +
                                              0.5)];
  };
  return {at(kTail), value, at(1 - kTail)};
}

}  // namespace

Interval mean_interval(std::span<const double> values) {
  if (values.empty()) return {};
  std::vector<double> means;
  for (std::uint32_t r = 0; r < kResamples; ++r) means.push_back(resampled_mean(values, r, 0));
  return interval_of(mean_of(values), std::move(means));
}

Interval ratio_interval(std::span<const double> above, std::span<const double> below) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (above.empty() || below.empty() || !(mean_of(below) > 0)) return {kNone, kNone, kNone};
  std::vector<double> ratios;
  for (std::uint32_t r = 0; r < kResamples; ++r) {
    const double divisor = resampled_mean(below, r, 1);
    if (divisor > 0) ratios.push_back(resampled_mean(above, r, 0) / divisor);
  }
  return interval_of(mean_of(above) / mean_of(below), std::move(ratios));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

double median(std::span<const double> values) {
  return quantile({values.begin(), values.end()}, 0.5);
}

}  // namespace baton
