#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace baton {

/// Channels that are negative, NaN or infinite become 0; such texels are counted, each as its worst
/// kind (NaN before infinite before negative).
struct TexelRepairs {
  std::uint64_t negative = 0, nan = 0, infinite = 0;
  std::uint64_t total() const { return negative + nan + infinite; }
};

/// The radiance of a texel of a file: rgb * scale, repaired and counted where it is none.
inline std::array<float, 3> texel_radiance(const float* rgb, float scale, TexelRepairs& repairs) {
  const auto is_radiance = [](float value) {
    return value >= 0 && value <= std::numeric_limits<float>::max();
  };
  // + 0: no channel is a negative zero, whose sign would be taken for that of its neighbours.
  std::array<float, 3> texel{rgb[0] * scale + 0.0f, rgb[1] * scale + 0.0f, rgb[2] * scale + 0.0f};
  if (is_radiance(texel[0]) && is_radiance(texel[1]) && is_radiance(texel[2])) return texel;
  bool nan = false;
  bool infinite = false;
  for (float& channel : texel) {
    if (is_radiance(channel)) continue;
    nan = nan || std::isnan(channel);
    infinite = infinite || std::isinf(channel);
    channel = 0;
  }
  (nan ? repairs.nan : infinite ? repairs.infinite : repairs.negative) += 1;
  return texel;
}

}  // namespace baton
