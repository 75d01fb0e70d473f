#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/vec3.h"

namespace baton {

/// The scatter of rounds that weigh the same in a pixel's mean, channel by channel.
class EqualRounds {
 public:
  void add(const Rgb& color, double weight) {
    ++count_;
    weight_ += weight;
    const std::array<float, 3> values{color.x, color.y, color.z};
    for (std::size_t c = 0; c < 3; ++c) {
      sum_[c] += double{values[c]};
      squares_[c] += double{values[c]} * double{values[c]};
    }
  }
  std::int32_t count() const { return count_; }
  double weight() const { return weight_; }
  double mean(std::size_t c) const { return sum_[c] / count_; }
  /// Variance of one round, without bias; needs two or more rounds.
  double variance(std::size_t c) const {
    return std::max(squares_[c] - sum_[c] * mean(c), 0.0) / (count_ - 1);
  }

 private:
  std::array<double, 3> sum_{}, squares_{};
  double weight_ = 0;
  std::int32_t count_ = 0;
};

/// The rounds of a pixel in two parts: those that judge, and the others, whose number follows from
/// what these found (AdaptiveRounds). Without judgement all are of the first part.
struct RoundScatter {
  EqualRounds first, rest;

  /// Variance of the weighted mean of all rounds. Without bias: the scatter of the first part is
  /// what it is whatever is decided from it, and that of the rest is given its number. A single
  /// later round has no scatter; its distance from the first mean stands for it, with the bias that
  /// clean blocks have a first mean nearer than others.
  Rgb variance_of_mean() const {
    std::array<float, 3> of_mean;
    const double all = first.weight() + rest.weight();
    const double first_share = first.weight() / all, rest_share = rest.weight() / all;
    for (std::size_t c = 0; c < 3; ++c) {
      double variance = first_share * first_share * first.variance(c) / first.count();
      if (rest.count() > 0) variance += rest_share * rest_share * of_rest(c) / rest.count();
      of_mean[c] = static_cast<float>(variance);
    }
    return {of_mean[0], of_mean[1], of_mean[2]};
  }

 private:
  /// Variance of one of the later rounds.
  double of_rest(std::size_t c) const {
    if (rest.count() > 1) return rest.variance(c);
    const double distance = rest.mean(c) - first.mean(c);
    return distance * distance / (1 + 1.0 / first.count());
  }
};

}  // namespace baton
