#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <span>

#include "common/state/block_memory.h"

namespace baton {

/// Directions are of a lamp where the density of the map's table (1/sr) is above this one: so many
/// times that of a map that is the same everywhere. What hides a lamp is another matter than what
/// hides the sky.
inline constexpr float kLampDensity = 4 / (4 * std::numbers::pi_v<float>);

/// V^, the expected visibility of each bin of a BlockMemory, in (0, 1): what a round starts from.
/// Few outcomes say little: a bin expects what its own rays found and, with the weight of some rays
/// more, what the four bins around its place expect, those what sixteen expect, those what its kind
/// (lamps or not) does, and that what all do [Vevoda et al. 2018: no few outcomes are trusted]. Of
/// nothing is expected that it is hidden because all else is: the guess for a kind is a half at
/// least.
struct VisibilityTable {
  alignas(64) std::array<float, BlockMemory::kCount> expected;
  /// The same in all bins: rays have always agreed, or there were none. `expected` is not filled.
  float everywhere = 0.5f;
  bool is_uniform = true;
  bool knows_rays = false;  ///< there were some

  /// Replaces the table. prior_rays: what the guess of the coarser bins counts, > 0.
  void read(const BlockMemory& memory, float prior_rays);
};

/// Enters traced rays into a block's memory: ray j in bin[j], free where bit j of `free` is set; at
/// most 64. A bin whose counts are full goes on with half of them.
void remember_rays(BlockMemory& memory, std::span<const std::uint16_t> bin, std::uint64_t free);

}  // namespace baton
