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

/// V^ of a pixel: its block's, in proportion to what its own rays have found beside that.
struct PixelVisibility {
  const VisibilityTable& of_block;
  /// Factors on V^ of the sky's bins, and of lamps'.
  std::array<float, 2> share{1, 1};

  explicit PixelVisibility(const VisibilityTable& block) : of_block(block) {}
  /// prior_rays: what the block's word counts beside the pixel's own rays, > 0.
  PixelVisibility(const VisibilityTable& block, const PixelMemory& own, float prior_rays);
};
/// The most that a pixel expects: nothing is certain.
inline constexpr float kMostVisible = 1 - 1.0f / 1024;

/// A ray as it is remembered: the bin of its direction, and V^ of the block there.
struct RayTag {
  static constexpr int kBinBits = 9;
  static_assert(std::size_t{1} << kBinBits == BlockMemory::kCount);

  std::uint16_t value;
  std::size_t bin() const { return value & ((1u << kBinBits) - 1); }
  /// In 1 / RayTally::kRay.
  std::uint16_t expected() const { return static_cast<std::uint16_t>(value >> kBinBits); }
};

/// Enters traced rays, at most 64, into what a block remembers and into what its pixel does: ray j
/// has tag[j] and was free where bit j of `free` is set. Full counts go on with half of them.
void remember_rays(std::span<const std::uint16_t> tag, std::uint64_t free, BlockMemory& block,
                   PixelMemory& pixel);

}  // namespace baton
