#pragma once

#include <span>
#include <vector>

namespace baton {

/// An estimate with its 95 % confidence interval.
struct Interval {
  double low = 0, value = 0, high = 0;
};

/// Mean of independent values, one a rendering, with the percentile bootstrap interval [Efron 1979]
/// of 1000 resamples, by fixed random numbers. One value is its own interval; none is 0.
Interval mean_interval(std::span<const double> values);

/// Ratio of the means of two independent sets of renderings, resampled apart. value: NaN when the
/// second mean is not positive.
Interval ratio_interval(std::span<const double> above, std::span<const double> below);

/// The value at a share of the sorted ones, [0, 1]; 0 without any.
double quantile(std::vector<double> values, double share);

/// The middle value; 0 without any.
double median(std::span<const double> values);

}  // namespace baton
