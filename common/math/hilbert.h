#pragma once

#include <cstdint>

namespace baton {

/// Place of the cell (x, y), each in [0, 65536), along the Hilbert curve through all 2^32 of them
/// [Hilbert 1891]. Cells that follow each other share an edge, and an aligned stretch of 4^k cells
/// is a square.
constexpr std::uint32_t hilbert_index(std::uint32_t x, std::uint32_t y) {
  std::uint32_t index = 0;
  for (std::uint32_t bit = 16; bit-- > 0;) {
    const std::uint32_t right = x >> bit & 1, up = y >> bit & 1;
    index = index * 4 + ((3 * right) ^ up);

    // Turn the quadrant so that the curve enters it at its lower left and leaves it at the right:
    // below, x and y change places, on the right after they are turned round. Without branches,
    // which nothing could predict.
    const std::uint32_t below = up - 1, turned = (0 - right) & below;
    x ^= turned;
    y ^= turned;
    const std::uint32_t swapped = (x ^ y) & below;
    x ^= swapped;
    y ^= swapped;
  }
  return index;
}

}  // namespace baton
