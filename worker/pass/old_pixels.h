#pragma once

#include <optional>
#include <span>
#include <vector>

#include "worker/accel/geometry_sequence.h"
#include "worker/pass/primary.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// Pixels of the frame before, by their place in the image: what they carry, and what they saw,
/// which is traced again, exactly: states hold no surfaces.
class OldPixels {
 public:
  struct Place {
    const SampleState* state = nullptr;
    std::size_t index = 0;      ///< pixel of `state`
    std::size_t first_hit = 0;  ///< of its sites
  };

  /// states: of the frame before, of every tile within reach. All must outlive the object.
  OldPixels(const JobSpec& job, const FrameGeometry& before, std::span<const StatePtr> states)
      : job_(job), before_(before), states_(states) {}

  const FrameGeometry& geometry() const { return before_; }

  /// Forgets all pixels.
  void clear() { rays_.clear(); }
  /// Asks for a pixel; nullopt where it lies in no state or saw no surface.
  std::optional<Place> ask(std::int32_t x, std::int32_t y);
  /// Traces what was asked for since clear().
  void trace();
  /// What the sites of a pixel saw; after trace().
  std::span<const SurfaceHit> hits(const Place& place) const {
    const auto num_sites = static_cast<std::size_t>(job_.image.sites);
    return std::span(hits_).subspan(place.first_hit, num_sites);
  }

  /// Rays traced so far.
  std::uint64_t num_rays() const { return num_rays_; }

 private:
  const JobSpec& job_;
  const FrameGeometry& before_;
  std::span<const StatePtr> states_;
  std::vector<Ray> rays_;
  std::vector<SurfaceHit> hits_;
  std::uint64_t num_rays_ = 0;
};

}  // namespace baton
