#include "worker/surface/map_row.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/octahedral.h"

namespace baton {

double place_in_linear(double first, double last, double u) {
  const double sum = first + std::sqrt(first * first + u * (last * last - first * first));
  return sum > 0 ? std::min(u * (first + last) / sum, 1.0) : u;
}

MapRow::MapRow(double top, double bottom, int width)
    : top_(top),
      height_(bottom - top),
      middle_(0.5 * (top + bottom)),
      sin_top_(std::sin(top)),
      cos_top_(std::cos(top)),
      sin_bottom_(std::sin(bottom)),
      cos_bottom_(std::cos(bottom)) {
  // Integrals over the row of sin and of (place - 1/2) sin.
  const double half = 0.5 * height_, cell = 2 * std::numbers::pi / width;
  const double even = 2 * std::sin(middle_) * std::sin(half);
  const double slope = 2 * std::cos(middle_) * (std::sin(half) - half * std::cos(half)) / height_;
  upper_weight_ = cell * (0.5 * even - slope);
  lower_weight_ = cell * (0.5 * even + slope);
  margin_down_ = std::min(0.5, kOctahedralError / height_);
  margin_across_ = std::min(0.5, kOctahedralError / (cell * std::max(std::sin(middle_), 1e-9)));
}

double MapRow::place(double upper, double lower, double u) const {
  // The integral of g(angle) sin(angle), g linear, is g' sin(angle) - g(angle) cos(angle).
  const double slope = (lower - upper) / height_;
  const double above = slope * sin_top_ - upper * cos_top_;
  const double wanted = above + u * (slope * sin_bottom_ - lower * cos_bottom_ - above);

  // Newton's method from the solution for a density that is linear between its ends; where it would
  // leave what is still open, in the middle of that. A step of kEnough leaves an error of about its
  // square: one is enough, as a rule.
  constexpr int kMostSteps = 40;
  constexpr double kEnough = 1e-4;
  double first = 0, last = 1;
  double at = place_in_linear(upper * sin_top_, lower * sin_bottom_, u);
  for (int step = 0; step < kMostSteps; ++step) {
    const double sine = std::sin(angle(at)), cosine = std::cos(angle(at));
    const double value = upper + at * (lower - upper);
    const double too_much = slope * sine - value * cosine - wanted;
    (too_much > 0 ? last : first) = at;
    double next = at - too_much / (value * sine * height_);
    if (!(next >= first && next <= last)) next = 0.5 * (first + last);
    const bool found = std::fabs(next - at) < kEnough;
    at = next;
    if (found) break;
  }
  return at;
}

}  // namespace baton
