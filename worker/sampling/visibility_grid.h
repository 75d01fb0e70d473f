#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/math/octahedral.h"

namespace baton {

/// What a pixel remembers of its shadow rays, so that later frames know where a ray is worth its
/// time. A guess, never a fact: whoever uses it must stay right whatever it says, and it may only
/// use the grid as the frames before left it.
///
/// A cell holds the share of free rays in 1/4095 (high 12 bits) and the rays seen, up to 15 (low 4
/// bits); from then on a new ray counts 1/17, so that old ones fade. Cells 0 to 255 are bins of the
/// octahedral lattice of directions (common/math/octahedral.h), row by row; one more cell counts
/// all rays, one more says which outcomes were ever seen, and the last two belong to the noise
/// of the pixel's light (light_noise.h). Bins are kept only once the rays have disagreed: a pixel
/// in the open needs no grid.
using VisibilityCell = std::uint16_t;

inline constexpr std::int32_t kVisibilityGridSide = 16;
inline constexpr std::size_t kVisibilityBins = 256;
inline constexpr std::size_t kVisibilitySummary =
    kVisibilityBins;  ///< index of the cell of all rays
inline constexpr std::size_t kVisibilityOutcomes =
    kVisibilityBins + 1;                                         ///< index of the cell of outcomes
inline constexpr std::size_t kLightNoise = kVisibilityBins + 2;  ///< index of the cells of noise
inline constexpr std::size_t kLobeNoise = kVisibilityBins + 3;
inline constexpr std::size_t kVisibilityCells = kVisibilityBins + 4;
inline constexpr VisibilityCell kSawFree = 1, kSawBlocked = 2;  ///< bits of the cell of outcomes

/// Bin of a direction, [0, 256): the upper four bits of each half of its code.
inline std::size_t visibility_bin(OctDirection code) {
  return (code >> 12 & 0x0F) | (code >> 24 & 0xF0);
}

/// Estimated share of free rays in a bin, in (0, 1): the bin's own, or that of all rays where it
/// has seen none. grid: (kVisibilityCells).
float free_share(std::span<const VisibilityCell> grid, std::size_t bin);

/// Adds rays, one after the other: ray j in bin[j], free where bit j of `free` is set; at most 64.
/// grid: (kVisibilityCells), all 0 at first.
void remember_rays(std::span<VisibilityCell> grid, std::span<const std::uint8_t> bin,
                   std::uint64_t free);
inline void remember_ray(std::span<VisibilityCell> grid, std::size_t bin, bool free) {
  const auto byte = static_cast<std::uint8_t>(bin);
  remember_rays(grid, {&byte, 1}, free ? 1 : 0);
}

}  // namespace baton
