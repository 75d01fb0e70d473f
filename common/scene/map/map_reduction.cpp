#include "common/scene/map/map_reduction.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/base/check.h"
#include "common/image/averaged_down.h"
#include "common/scene/map/map_texel.h"

namespace baton {
namespace {

/// cos a - cos b without cancellation.
double zone(double a, double b) { return 2 * std::sin(0.5 * (a + b)) * std::sin(0.5 * (b - a)); }

}  // namespace

std::array<int, 2> map_sides(int width, int height, int max_width) {
  if (max_width == 0 || width <= max_width) return {width, height};
  return {max_width, std::max(1, static_cast<int>(std::lround(1.0 * height * max_width / width)))};
}

RgbImage reduce_map(const RgbImage& map, int width, float scale) {
  BATON_CHECK(width > 0 && width < map.width);
  const int height = map_sides(map.width, map.height, width)[1];
  const auto angle = [&](std::int64_t edge) {
    return std::numbers::pi * static_cast<double>(edge) / (1.0 * map.height * height);
  };

  // The radiance of the row that is asked for.
  std::vector<float> radiance(static_cast<std::size_t>(map.width) * 3);
  int last = -1;
  const auto row = [&](int y) {
    const float* texel = &map.rgb[static_cast<std::size_t>(y) * map.width * 3];
    for (std::size_t i = 0; y != last && i < radiance.size(); i += 3)
      std::ranges::copy(texel_radiance(texel + i, scale), radiance.begin() + i);
    last = y;
    return radiance.data();
  };
  return averaged_down(
      RowSource{map.width, map.height, row}, width, height,
      [&](std::int64_t from, std::int64_t to) { return zone(angle(from), angle(to)); });
}

}  // namespace baton
