#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace baton {

/// The share of free rays in 1/4095 (high 12 bits) and the rays seen, up to 15 (low 4 bits).
using VisibilityCell = std::uint16_t;

/// How visible the light was in each bin of the octahedral lattice of directions
/// (common/math/octahedral.h), row by row: the upper kBits of each half of a code.
struct VisibilityBins {
  static constexpr int kBits = 3;
  static constexpr std::size_t kSide = std::size_t{1} << kBits, kCount = kSide * kSide;
  std::array<VisibilityCell, kCount> cells{};

  bool operator==(const VisibilityBins&) const = default;
};

/// What a pixel of `pool` remembers of the frames before: how visible the light was, and how noisy.
/// An estimate: who uses it must be unbiased whatever its contents are, and may only use what
/// the frames before left. All 0: nothing is known.
struct PixelMemory {
  static constexpr std::uint16_t kSawFree = 1, kSawBlocked = 2, kSawBoth = 3;
  /// In a file before packing, at most: a bit for each bin, all of them, and what is below.
  static constexpr std::size_t kMaxStoredBytes =
      VisibilityBins::kCount / 8 + (VisibilityBins::kCount + 4) * sizeof(VisibilityCell);

  /// All 0 until both outcomes were seen. They come first: kernels load two cells at once, and the
  /// neighbour of the last one is all_rays.
  VisibilityBins bins;
  VisibilityCell all_rays = 0;
  /// Outcomes that were ever seen: kSawFree, kSawBlocked.
  std::uint16_t outcomes = 0;
  /// The variance of its unshadowed light by candidates of either kind, the upper half of a float
  /// (worker/sampling/light_noise.h).
  std::uint16_t light_noise = 0, lobe_noise = 0;

  bool has_bins() const { return outcomes == kSawBoth; }
  bool operator==(const PixelMemory&) const = default;
};
static_assert(sizeof(PixelMemory) == 136);

}  // namespace baton
