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

/// Rays of a pixel beside what its block expected of them, in 1 / kRay rays.
struct RayTally {
  static constexpr std::uint16_t kRay = 127;
  static constexpr std::uint16_t kMost = 256 * kRay;  ///< past it both are halved

  std::uint16_t expected = 0;  ///< sum of V^ as the block had it
  std::uint16_t free = 0;      ///< rays that were

  bool operator==(const RayTally&) const = default;
};

/// What a pixel remembers by itself.
struct PixelMemory {
  /// The variance of its unshadowed light by candidates of either kind, the upper half of a float
  /// (worker/sampling/light_noise.h). 0: nothing is known.
  std::uint16_t light_noise = 0, lobe_noise = 0;
  /// Into the bins of the sky, and into those of lamps. A pixel in the shadow among others in the
  /// light finds less than its block expects.
  std::array<RayTally, 2> rays{};

  bool operator==(const PixelMemory&) const = default;
};
static_assert(sizeof(PixelMemory) == 12);

}  // namespace baton
