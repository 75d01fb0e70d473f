#include "worker/sampling/pixel_filter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace baton {
namespace {

/// Draws from a filter as a piecewise constant density: finds the cell whose share of the
/// cumulative distribution contains u, from a guide on [Chen & Asau 1974].
class FilterTable {
 public:
  explicit FilterTable(PixelFilter filter)
      : radius_(static_cast<float>(filter_radius(filter))), step_(2 * radius_ / kCells) {
    std::array<double, kCells + 1> sum{};
    for (std::size_t i = 0; i < kCells; ++i) {
      const double middle = (static_cast<double>(i) + 0.5) / kCells * 2 - 1;
      sum[i + 1] = sum[i] + filter_weight(filter, middle * filter_radius(filter));
    }
    for (std::size_t i = 0; i <= kCells; ++i)
      cumulative_[i] = static_cast<float>(sum[i] / sum[kCells]);
    std::size_t cell = 0;
    for (std::size_t k = 0; k < kCells; ++k) {
      const float start = static_cast<float>(k) / kCells;
      while (cumulative_[cell + 1] <= start) ++cell;
      guide_[k] = static_cast<std::uint16_t>(cell);
    }
  }
  /// Distance from the centre. u: [0, 1]; 1, to which the sum of a site's cell and its place in it
  /// may round, is the number before it.
  float operator()(float u) const {
    u = std::min(u, 0x1.fffffep-1f);
    std::size_t cell = guide_[static_cast<std::size_t>(u * kCells)];
    while (cumulative_[cell + 1] <= u) ++cell;
    const float along = (u - cumulative_[cell]) / (cumulative_[cell + 1] - cumulative_[cell]);
    return (static_cast<float>(cell) + along) * step_ - radius_;
  }

 private:
  static constexpr std::size_t kCells = 2048;
  std::array<float, kCells + 1> cumulative_;
  /// By k: the first cell that u >= k / kCells may lie in.
  std::array<std::uint16_t, kCells> guide_;
  float radius_, step_;
};

}  // namespace

double filter_radius(PixelFilter filter) {
  switch (filter) {
    case PixelFilter::box:
      return 0.5;
    case PixelFilter::gaussian:
      return 2.25;
    case PixelFilter::blackman_harris:
      return 1.5;
  }
  return 0;
}

double filter_weight(PixelFilter filter, double distance) {
  const double radius = filter_radius(filter);
  if (std::fabs(distance) >= radius) return 0;
  switch (filter) {
    case PixelFilter::box:
      return 1;
    case PixelFilter::gaussian: {
      const double d = distance / 0.75;
      return std::exp(-2 * d * d);
    }
    case PixelFilter::blackman_harris: {
      const double angle = std::numbers::pi * (distance / radius + 1);
      return 0.35875 - 0.48829 * std::cos(angle) + 0.14128 * std::cos(2 * angle) -
             0.01168 * std::cos(3 * angle);
    }
  }
  return 0;
}

std::array<float, 2> filter_position(PixelFilter filter, const std::array<float, 2>& u) {
  if (filter == PixelFilter::box) return u;
  static const FilterTable kGaussian(PixelFilter::gaussian);
  static const FilterTable kBlackmanHarris(PixelFilter::blackman_harris);
  const FilterTable& table = filter == PixelFilter::gaussian ? kGaussian : kBlackmanHarris;
  return {0.5f + table(u[0]), 0.5f + table(u[1])};
}

}  // namespace baton
