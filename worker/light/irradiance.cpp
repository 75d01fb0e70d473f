#include "worker/light/irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace baton {

Rgb irradiance(const Environment& environment, const Vec3& normal) {
  // A grid of points in angle, at least as fine as the texels.
  constexpr int kLeastColumns = 1024;
  const EnvironmentMap& map = *environment.map;
  const int per_texel = std::max(1, (kLeastColumns + map.width() - 1) / map.width());
  const int columns = map.width() * per_texel, rows = map.height() * per_texel;
  const Vec3 n = environment.rotation.transposed() * normal;  // in the map's frame
  const double step = std::numbers::pi / rows;
  std::array<double, 3> sum{};
  std::vector<std::array<double, 2>> longitudes;  // sine and cosine
  for (int i = 0; i < columns; ++i) {
    const double longitude = (0.5 - (i + 0.5) / columns) * 2 * std::numbers::pi;
    longitudes.push_back({std::sin(longitude), std::cos(longitude)});
  }
  for (int j = 0; j < rows; ++j) {
    const double theta = (j + 0.5) * step;
    const double area =
        (std::cos(j * step) - std::cos((j + 1) * step)) * 2 * std::numbers::pi / columns;
    const double sine = std::sin(theta), height = std::cos(theta) * double{n.y};
    const EnvironmentMap::Texel* const row =
        map.texels() + static_cast<std::size_t>(j / per_texel + 1) * map.stride() + 1;
    for (int i = 0; i < columns; ++i) {
      const auto [sin_longitude, cos_longitude] = longitudes[static_cast<std::size_t>(i)];
      const double cosine =
          height + sine * (sin_longitude * double{n.x} + cos_longitude * double{n.z});
      if (!(cosine > 0)) continue;
      const EnvironmentMap::Texel texel =
          per_texel == 1 ? row[i]
                         : map.evaluate({static_cast<float>(sine * sin_longitude),
                                         static_cast<float>(std::cos(theta)),
                                         static_cast<float>(sine * cos_longitude)});
      const double weight = area * cosine;
      sum[0] += weight * double{texel.r};
      sum[1] += weight * double{texel.g};
      sum[2] += weight * double{texel.b};
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

}  // namespace baton
