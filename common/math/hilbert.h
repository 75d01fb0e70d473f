#pragma once

#include <cstdint>
#include <utility>

namespace baton {

/// Place of the cell (x, y), each in [0, 65536), along the Hilbert curve through all 2^32 of them
/// [Hilbert 1891]. Cells that follow each other share an edge, and an aligned stretch of 4^k cells
/// is a square.
constexpr std::uint32_t hilbert_index(std::uint32_t x, std::uint32_t y) {
  std::uint32_t index = 0;
  for (std::uint32_t bit = 1u << 15; bit > 0; bit /= 2) {
    const bool right = (x & bit) != 0;
    const bool up = (y & bit) != 0;
    index = index * 4 + ((right ? 3u : 0u) ^ (up ? 1u : 0u));

    // Turn the quadrant so that the curve enters it at its lower left and leaves it at the right.
    if (up) continue;
    if (right) {
      x = ~x;
      y = ~y;
    }
    std::swap(x, y);
  }
  return index;
}

}  // namespace baton
