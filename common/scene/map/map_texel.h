#pragma once

#include <array>
#include <limits>

namespace baton {

/// Whether a number, times `scale`, is a radiance: neither negative nor NaN nor infinite.
inline bool is_radiance(float value, float scale) {
  return value * scale >= 0 && value * scale <= std::numeric_limits<float>::max();
}

/// The radiance of a texel of a file: rgb * scale, 0 where that is none.
inline std::array<float, 3> texel_radiance(const float* rgb, float scale) {
  // + 0: no channel is a negative zero, whose sign would be taken for that of its neighbours.
  const auto radiance = [scale](float value) {
    return is_radiance(value, scale) ? value * scale + 0.0f : 0.0f;
  };
  return {radiance(rgb[0]), radiance(rgb[1]), radiance(rgb[2])};
}

}  // namespace baton
