#pragma once

#include <cstddef>
#include <vector>

#include "common/math/pixel_rect.h"

namespace baton {

/// OpenEXR works on the calling thread, and on those that it is lent (exr_threads.h).
inline constexpr int kOpenExrThreads = 0;
/// For how many threads OpenEXR keeps blocks of lines in hand when it writes: two for each, of some
/// megabytes.
inline constexpr int kOpenExrWriters = 2;

/// The address that pixel (0, 0) would have, which OpenEXR wants, where `rect` is stored from
/// `base`.
inline char* at_corner(char* base, const PixelRect& rect, std::size_t pixel_bytes) {
  const auto bytes = static_cast<std::ptrdiff_t>(pixel_bytes);
  return base - bytes * (std::ptrdiff_t{rect.y0} * rect.width() + rect.x0);
}

inline void negate(std::vector<float>& values) {
  for (float& v : values) v = -v;
}

}  // namespace baton
