#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace baton {

/// The share of free rays in 1/4095 (high 12 bits) and the rays seen, up to 15 (low 4 bits).
using VisibilityCell = std::uint16_t;

/// What a pixel of `pool` remembers of the frames before: how visible the light was, and how noisy.
/// A guess, never a fact: whoever uses it must stay right whatever it says, and may only use what
/// the frames before left. All 0: nothing is known.
struct PixelMemory {
  static constexpr std::size_t kSide = 16, kBins = kSide * kSide;
  static constexpr std::uint16_t kSawFree = 1, kSawBlocked = 2, kSawBoth = 3;

  /// Bins of the octahedral lattice of directions (common/math/octahedral.h), row by row: the upper
  /// four bits of each half of a code. Kept once rays have disagreed: a pixel in the open needs
  /// none.
  std::array<VisibilityCell, kBins> bins{};
  VisibilityCell all_rays = 0;
  std::uint16_t outcomes = 0;  ///< that were ever seen: kSawFree, kSawBlocked
  /// The variance of its unshadowed light by candidates of either kind, the upper half of a float
  /// (worker/sampling/light_noise.h).
  std::uint16_t light_noise = 0, lobe_noise = 0;

  bool operator==(const PixelMemory&) const = default;
};
static_assert(sizeof(PixelMemory) == 520);

}  // namespace baton
