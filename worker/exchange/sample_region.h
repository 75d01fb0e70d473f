#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/state/first_pass_samples.h"
#include "worker/exchange/pixel_mask.h"

namespace baton {

using FirstPassPtr = std::shared_ptr<const FirstPassSamples>;

/// The first pass's samples of some tiles, found by image pixel.
class SampleRegion {
 public:
  /// tiles must outlive the region.
  explicit SampleRegion(std::span<const FirstPassPtr> tiles);

  /// Where a pixel's samples lie: [first, first + count) in the arrays of `tile`; null for a pixel
  /// of no tile.
  struct Place {
    const FirstPassSamples* tile = nullptr;
    std::size_t pixel = 0;
    std::size_t first = 0;
    std::size_t count = 0;

    /// Those of one population (-1: of all): slots ascend, so they lie together.
    Place of_population(int population) const;
  };
  Place find(std::int32_t x, std::int32_t y) const;

  /// Pixels of `rect` with a failed ray of the population (-1: of any).
  PixelMask failed(const PixelRect& rect, int population) const;
  /// Pixels of `rect` that see a surface.
  PixelMask surfaces(const PixelRect& rect) const;

 private:
  PixelMask flagged(const PixelRect& rect, int bits) const;

  struct Tile {
    const FirstPassSamples* samples;
    std::vector<std::uint32_t> first;  ///< (pixels)
  };
  std::vector<Tile> tiles_;
};

}  // namespace baton
