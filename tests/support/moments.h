#pragma once

#include <algorithm>
#include <cmath>

namespace baton::test {

/// Mean of independent values and its standard error.
struct Moments {
  double sum = 0, squares = 0;
  int count = 0;

  void add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }
  double mean() const { return sum / count; }
  double variance() const { return std::max(squares / count - mean() * mean(), 0.0); }
  double variance_of_mean() const { return variance() / (count - 1); }
  double error() const { return std::sqrt(variance_of_mean()); }
  /// How many standard errors lie between the mean and what is expected.
  double z(double expected) const {
    return std::fabs(mean() - expected) / std::max(error(), 1e-12);
  }
};

}  // namespace baton::test
