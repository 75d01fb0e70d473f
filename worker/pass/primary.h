#pragma once

#include <utility>
#include <vector>

#include "common/base/frame_keep.h"
#include "worker/pass/render_context.h"
#include "worker/pass/round_pixels.h"

namespace baton {

/// What the sites of pixels of a tile see in one frame: a pure function of (job, pixel, site), and
/// of the frame where camera or objects move.
struct TileSurfaces {
  PixelRect rect;
  RoundPixels pixels;            ///< with a slot each
  std::int32_t num_sites = 1;    ///< S
  std::vector<SurfaceHit> hits;  ///< (slots, S)
  std::vector<Ray> rays;         ///< (slots, S) primary rays
  /// (slots, S) Of hits whose materials have detail: textures are looked up once for all frames and
  /// rounds that see the same. Empty where the scene has none.
  std::vector<SurfaceLook> looks;
  /// (slots) The first site that sees a surface, S where none does: hits are large, and whether
  /// there is one is asked several times a frame.
  std::vector<std::uint8_t> first_site;

  bool sees_surface(std::size_t slot) const { return first_site[slot] < num_sites; }
  /// Of a pixel that sees one.
  const SurfaceHit& first_surface(std::size_t slot) const {
    return hits[slot * static_cast<std::size_t>(num_sites) + first_site[slot]];
  }
  std::span<const SurfaceHit> pixel(std::size_t slot) const {
    return std::span(hits).subspan(slot * static_cast<std::size_t>(num_sites),
                                   static_cast<std::size_t>(num_sites));
  }
  /// Of its sites; empty where the scene has no detail.
  std::span<const SurfaceLook> pixel_looks(std::size_t slot) const {
    if (looks.empty()) return {};
    return std::span(looks).subspan(slot * static_cast<std::size_t>(num_sites),
                                    static_cast<std::size_t>(num_sites));
  }
  /// Of hit number `at`, or null.
  const SurfaceLook* look(std::size_t at) const { return looks.empty() ? nullptr : &looks[at]; }
  std::size_t size_bytes() const { return size_bytes(pixels.size(), num_sites, !looks.empty()); }
  /// Of so many pixels.
  static std::size_t size_bytes(std::size_t num_pixels, std::int32_t num_sites, bool has_detail) {
    const auto rays = num_pixels * static_cast<std::size_t>(num_sites);
    return rays * (sizeof(SurfaceHit) + sizeof(Ray) + (has_detail ? sizeof(SurfaceLook) : 0)) +
           num_pixels;
  }
};

/// What the tiles of this process saw last, by frame index and tile, where things move: the next
/// frame asks for it again, and tracing it a second time is the same work with the same result.
class SurfaceCache : public FrameKeep<std::pair<std::int32_t, std::int32_t>, TileSurfaces> {
 public:
  using FrameKeep::FrameKeep;
};

/// Pass 1: one primary ray for each site of each pixel. A single site of a single round shoots
/// through the pixel's centre, if the filter is the box; else sites are jittered on a sqrt(S) x
/// sqrt(S) grid over image.filter, in each round anew (rounds_have_own_sites): those of a cell are
/// points of a low-discrepancy sequence. The same for all frames.
TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                           std::int32_t round = 0);
/// Of some pixels of a tile.
TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                           RoundPixels pixels, std::int32_t round);

/// What some pixels of a tile see, of what all of them do.
TileSurfaces part_of(const TileSurfaces& whole, RoundPixels pixels);

/// The same for pixels one by one: appends the rays of the sites of pixel (x, y). Hits are the same
/// as of a whole tile.
void append_primary_rays(const JobSpec& job, const FrameGeometry& geometry, std::int32_t x,
                         std::int32_t y, std::vector<Ray>& rays, std::int32_t round = 0);
void trace_primary_rays(const JobSpec& job, const FrameGeometry& geometry,
                        std::span<const Ray> rays, std::span<SurfaceHit> hits);

/// Adds to each pixel what its sites that see no surface show of the environment, as a share of all
/// its sites. hits, rays: (pixels, num_sites); radiance: (pixels).
void add_environment_behind(std::span<const SurfaceHit> hits, std::span<const Ray> rays,
                            std::int32_t num_sites, const EnvironmentView& environment,
                            std::span<Rgb> radiance);

}  // namespace baton
