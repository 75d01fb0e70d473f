#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "worker/accel/geometry_sequence.h"
#include "worker/pass/fine_sites.h"
#include "worker/pass/primary.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// Pixels of the frame before, by their place in the image: what they carry, and what they saw.
/// States have no surfaces: those that this process no longer keeps are traced again, exactly.
class OldPixels {
 public:
  struct Place {
    const SampleState* state = nullptr;
    std::size_t index = 0;               ///< pixel of `state`
    const TileSurfaces* kept = nullptr;  ///< what the tile saw; null: traced again
    std::size_t traced = 0;              ///< number among those traced again
  };

  /// states: of the frame before, of every tile within reach. All must outlive the object.
  OldPixels(const RenderContext& context, const FrameGeometry& before,
            std::span<const StatePtr> states);

  const FrameGeometry& geometry() const { return before_; }

  /// Forgets all pixels.
  void clear() { asked_.clear(); }
  /// Requests a pixel; nullopt where it lies in no state or saw no surface.
  std::optional<Place> ask(std::int32_t x, std::int32_t y);
  /// Traces what was requested since clear() and is not kept.
  void trace();
  /// What the first image.sites sites of a pixel saw; after trace().
  std::span<const SurfaceHit> hits(const Place& place) const {
    const auto num_sites = static_cast<std::size_t>(job_.image.sites);
    if (place.kept != nullptr) return place.kept->pixel(place.index).first(num_sites);
    return std::span(hits_).subspan(first_hit_[place.traced], num_sites);
  }

  /// Textures at their hits, where they are kept, else none.
  std::span<const SurfaceShading> shadings(const Place& place) const {
    if (place.kept == nullptr) return {};
    return place.kept->pixel_shadings(place.index);
  }

  /// Rays of all pixels requested so far; those of kept tiles count, too, so that the number does
  /// not depend on who rendered what.
  std::uint64_t num_rays() const { return num_rays_; }

 private:
  const JobSpec& job_;
  const FrameGeometry& before_;
  std::span<const StatePtr> states_;
  const std::int32_t round_;                               ///< whose sites carry the samples
  std::vector<std::shared_ptr<const TileSurfaces>> kept_;  ///< (states)
  std::vector<PixelPlace> asked_;                          ///< pixels that are not kept
  std::vector<std::size_t> first_hit_;                     ///< (asked)
  std::vector<SurfaceHit> hits_;
  std::uint64_t num_rays_ = 0;
};

}  // namespace baton
