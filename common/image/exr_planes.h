#pragma once

#include <cstddef>
#include <vector>

#include "common/math/pixel_rect.h"

namespace baton {

/// OpenEXR works on the calling thread: the worker has its own threads.
inline constexpr int kOpenExrThreads = 0;

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
