#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace baton {

/// Rays of the pixels of a block that went into a bin of directions.
struct VisibilityCell {
  static constexpr int kMostSeen = 255;

  std::uint8_t seen = 0;  ///< where that is full, both are halved
  std::uint8_t free = 0;  ///< of them; at most `seen`

  bool operator==(const VisibilityCell&) const = default;
};

/// How visible the light was from a block of pixels (common/math/pixel_blocks.h) in the frames
/// before: counts of rays in bins of the octahedral lattice of directions
/// (common/math/octahedral.h), row by row, of the upper kBits of each half of a code. Lamps, parts
/// of the map that are brighter than the rest (worker/sampling/visibility_table.h), have bins of
/// their own, after the others: what hides a sun does not hide the sky beside it. An estimate: who
/// uses it must be unbiased whatever it says, and may only use what the rounds before left.
struct BlockMemory {
  static constexpr int kBits = 4;
  static constexpr std::size_t kSide = std::size_t{1} << kBits, kBins = kSide * kSide;
  static constexpr std::size_t kCount = 2 * kBins;  ///< those of the lamps are the second half

  std::array<VisibilityCell, kCount> cells{};

  bool operator==(const BlockMemory&) const = default;
};
static_assert(sizeof(BlockMemory) == 1024);

/// The variance of a pixel's unshadowed light by candidates of either kind, the upper halves of
/// floats (worker/sampling/light_noise.h). 0: nothing is known.
struct PixelNoise {
  std::uint16_t light = 0, lobes = 0;

  bool operator==(const PixelNoise&) const = default;
};

}  // namespace baton
