#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/vec3.h"

namespace baton {

/// What is told of the error of a pixel: the variance of its R, G, B and of their mean.
struct PixelVariance {
  Rgb color{};
  float grey = 0;
};

/// The scatter of rounds that weigh the same in a pixel's mean, of R, G, B and grey.
class EqualRounds {
 public:
  static constexpr std::size_t kValues = 4;

  void add(const Rgb& color, double weight) {
    ++count_;
    weight_ += weight;
    const std::array<double, kValues> values{double{color.x}, double{color.y}, double{color.z},
                                             double{mean_of(color)}};
    for (std::size_t c = 0; c < kValues; ++c) {
      sum_[c] += values[c];
      squares_[c] += values[c] * values[c];
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
  static float mean_of(const Rgb& color) { return baton::mean(color); }

  std::array<double, kValues> sum_{}, squares_{};
  double weight_ = 0;
  std::int32_t count_ = 0;
};

/// The rounds of a pixel in two parts: those that judge and the others, whose number follows from
/// what these found (AdaptiveRounds); without judgement the first half and the second.
struct RoundScatter {
  EqualRounds first, rest;

  /// Variance of the mean of all rounds, which weigh the same, by the distance of the halves. Sites
  /// are stratified over consecutive rounds, so that the mean of a half errs less at edges than its
  /// rounds by themselves would say; what the halves take from each other is left out. Both parts
  /// need a round.
  PixelVariance of_halves() const {
    const double all = first.weight() + rest.weight();
    const double shares = first.weight() * rest.weight() / (all * all);
    return of_each([&](std::size_t c) {
      const double distance = first.mean(c) - rest.mean(c);
      return shares * distance * distance;
    });
  }

  /// Variance of the weighted mean of judging rounds and others. Without bias: the scatter of the
  /// first part is what it is whatever is decided from it, and that of the rest is given its
  /// number. A single later round has no scatter; its distance from the first mean stands for it,
  /// with the bias that clean blocks have a first mean nearer than others.
  PixelVariance of_judged() const {
    const double all = first.weight() + rest.weight();
    const double first_share = first.weight() / all, rest_share = rest.weight() / all;
    return of_each([&](std::size_t c) {
      double variance = first_share * first_share * first.variance(c) / first.count();
      if (rest.count() > 0) variance += rest_share * rest_share * of_rest(c) / rest.count();
      return variance;
    });
  }

 private:
  template <class F>
  static PixelVariance of_each(F variance) {
    std::array<float, EqualRounds::kValues> v;
    for (std::size_t c = 0; c < v.size(); ++c) v[c] = static_cast<float>(variance(c));
    return {{v[0], v[1], v[2]}, v[3]};
  }
  /// Variance of one of the later rounds.
  double of_rest(std::size_t c) const {
    if (rest.count() > 1) return rest.variance(c);
    const double distance = rest.mean(c) - first.mean(c);
    return distance * distance / (1 + 1.0 / first.count());
  }
};

}  // namespace baton
