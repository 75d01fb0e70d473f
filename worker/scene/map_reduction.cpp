#include "worker/scene/map_reduction.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "common/base/check.h"

namespace baton {
namespace {

/// Adds a row's radiance, times `weight`, to the columns that it lies in. In units of 1 / columns
/// texel i of the row is [i columns, (i + 1) columns), column k is [k width, (k + 1) width): a
/// texel has part in two columns at most. columns: (num_columns, 3) sums.
void add_row(const float* row, int width, float scale, double weight, std::vector<double>& columns,
             TexelRepairs& repairs) {
  const auto num_columns = static_cast<std::int64_t>(columns.size()) / 3;
  const double unit = weight / width;
  double* sum = columns.data();
  std::int64_t end = width;
  for (std::int64_t begin = 0; begin < width * num_columns; begin += num_columns, row += 3) {
    if (begin >= end) {
      sum += 3;
      end += width;
    }
    const std::array<float, 3> radiance = texel_radiance(row, scale, repairs);
    const std::int64_t inside = std::min(end - begin, num_columns);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += unit * static_cast<double>(inside) * radiance[k];
    if (inside == num_columns) continue;
    const double outside = unit * static_cast<double>(num_columns - inside);
    for (std::size_t k = 0; k < 3; ++k) sum[3 + k] += outside * radiance[k];
  }
}

/// cos a - cos b without cancellation.
double zone(double a, double b) { return 2 * std::sin(0.5 * (a + b)) * std::sin(0.5 * (b - a)); }

}  // namespace

std::array<int, 2> map_sides(int width, int height, int max_width) {
  if (max_width == 0 || width <= max_width) return {width, height};
  return {max_width, std::max(1, static_cast<int>(std::lround(1.0 * height * max_width / width)))};
}

ReducedMap reduce_map(const RgbImage& map, int width, float scale) {
  BATON_CHECK(width > 0 && width < map.width);
  const int height = map_sides(map.width, map.height, width)[1];
  ReducedMap reduced{{width, height, {}}, {}};
  reduced.image.rgb.reserve(std::size_t{3} * static_cast<std::size_t>(width) * height);
  const auto angle = [&](std::int64_t edge) {
    return std::numbers::pi * static_cast<double>(edge) / (1.0 * map.height * height);
  };

  // Row by row, with edges in units of pi / (both heights): a row of the map that lies in two
  // counts for both, but its repairs once.
  std::vector<double> sums(static_cast<std::size_t>(width) * 3);
  for (std::int64_t r = 0; r < height; ++r) {
    const std::int64_t top = r * map.height, bottom = top + map.height;
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::int64_t j = top / height; j * height < bottom; ++j) {
      const std::int64_t from = std::max(j * height, top);
      const std::int64_t to = std::min((j + 1) * height, bottom);
      const double weight = zone(angle(from), angle(to)) / zone(angle(top), angle(bottom));
      TexelRepairs ignored;
      add_row(&map.rgb[static_cast<std::size_t>(j) * map.width * 3], map.width, scale, weight, sums,
              j * height < top ? ignored : reduced.repairs);
    }
    for (const double sum : sums) reduced.image.rgb.push_back(static_cast<float>(sum));
  }
  return reduced;
}

EnvironmentMap make_map(const RgbImage& picture, const EnvironmentSpec& environment,
                        bool compensate, const HiddenCone& hidden) {
  const int width = map_sides(picture.width, picture.height, environment.max_width)[0];
  if (width == picture.width)
    return {picture, environment.filter, environment.scale, compensate, {}, hidden};
  const ReducedMap reduced = reduce_map(picture, width, environment.scale);
  return {reduced.image, environment.filter, 1, compensate, reduced.repairs, hidden};
}

}  // namespace baton
