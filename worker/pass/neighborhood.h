#pragma once

#include <array>
#include <span>
#include <vector>

#include "worker/method/carried/carried_set.h"
#include "worker/pass/old_pixels.h"

namespace baton {

/// Pass: the neighbours whose samples of the frame before a pixel weighs beside its own [Wyman &
/// Panteleev 2021]: sampling.num_neighbors pixels, each drawn anew in each frame from a disk around
/// the place that the pixel's own history comes from. One is asked only if it saw the same object,
/// turned alike and as far away; that depends on surfaces alone, so it cannot bias.
class Neighborhood {
 public:
  /// now: the frame's geometry. All must outlive the object.
  Neighborhood(const RenderContext& context, const FrameGeometry& now, OldPixels& old_pixels);

  /// Forgets all pixels, and makes room for `count`.
  void clear(std::size_t count);
  /// Draws the neighbours of pixel i, which sees `hits` and was at (x, y) in the frame before, and
  /// requests what they saw.
  void look_up(std::size_t i, std::span<const SurfaceHit> hits, const RngKey& key, std::int32_t x,
               std::int32_t y);
  /// The sets of those neighbours that agree, until the next call; after OldPixels::trace().
  /// catchers: of the frame before.
  std::span<const CarriedSet> sets(std::size_t i, std::span<const SurfaceHit> hits,
                                   CatcherAlbedo& catchers);

 private:
  using Places = std::array<OldPixels::Place, limits::kMaxNeighbors>;  ///< null state: none

  bool agrees(std::span<const SurfaceHit> now, std::span<const SurfaceHit> old) const;

  const RenderContext& context_;
  const FrameGeometry& now_;
  OldPixels& old_pixels_;
  const float cos_normal_tolerance_;
  std::vector<Places> places_;  ///< by pixel
  std::array<OldSurfaces, limits::kMaxNeighbors> surfaces_;
  std::array<CarriedSet, limits::kMaxNeighbors> sets_;
};

}  // namespace baton
