#include "worker/exchange/sample_region.h"

#include <algorithm>
#include <numeric>

namespace baton {

SampleRegion::SampleRegion(std::span<const FirstPassPtr> tiles) {
  for (const FirstPassPtr& samples : tiles) {
    Tile tile{samples.get(), std::vector<std::uint32_t>(samples->count.size())};
    std::exclusive_scan(samples->count.begin(), samples->count.end(), tile.first.begin(), 0u);
    tiles_.push_back(std::move(tile));
  }
}

SampleRegion::Place SampleRegion::Place::of_population(int population) const {
  if (population < 0 || count == 0) return *this;
  const auto begin = tile->slot.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  const std::int32_t per_population = tile->num_slots / tile->num_populations;
  const auto from = std::lower_bound(begin, end, population * per_population);
  const auto to = std::lower_bound(from, end, (population + 1) * per_population);
  return {tile, pixel, first + static_cast<std::size_t>(from - begin),
          static_cast<std::size_t>(to - from)};
}

SampleRegion::Place SampleRegion::find(std::int32_t x, std::int32_t y) const {
  for (const Tile& tile : tiles_) {
    const PixelRect& rect = tile.samples->rect;
    if (!rect.contains(x, y)) continue;
    const std::size_t pixel = PixelMask::index(rect, x, y);
    return {tile.samples, pixel, tile.first[pixel], tile.samples->count[pixel]};
  }
  return {};
}

PixelMask SampleRegion::failed(const PixelRect& rect, int population) const {
  return flagged(rect, population < 0 ? FirstPassSamples::kFailed[0] | FirstPassSamples::kFailed[1]
                                      : FirstPassSamples::kFailed[population]);
}

PixelMask SampleRegion::surfaces(const PixelRect& rect) const {
  return flagged(rect, FirstPassSamples::kSurface);
}

PixelMask SampleRegion::flagged(const PixelRect& rect, int bits) const {
  PixelMask mask(rect);
  for (const Tile& tile : tiles_) {
    const PixelRect& own = tile.samples->rect;
    for (std::int32_t y = std::max(rect.y0, own.y0); y < std::min(rect.y1, own.y1); ++y) {
      for (std::int32_t x = std::max(rect.x0, own.x0); x < std::min(rect.x1, own.x1); ++x) {
        if ((tile.samples->flags[PixelMask::index(own, x, y)] & bits) != 0) mask.set(x, y);
      }
    }
  }
  return mask;
}

}  // namespace baton
