#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/job/step_keep.h"
#include "worker/pass/render_context.h"
#include "worker/pass/round_pixels.h"

namespace baton {

/// What the sites of pixels of a tile see in one frame: a pure function of (job, pixel, site), and
/// of the frame where camera or objects move.
struct TileSurfaces {
  PixelRect rect;
  RoundPixels pixels;  ///< with a slot each
  /// (slots + 1) where the hits of each slot begin, and where the last one's end.
  std::vector<std::uint32_t> first_hit{0};
  std::vector<SurfaceHit> hits;  ///< (sum of S)
  std::vector<Ray> rays;         ///< (sum of S) primary rays
  /// (sum of S) Textures at hits whose materials have detail, which are looked up once for all
  /// frames and rounds that see the same. Empty where the scene has none.
  std::vector<SurfaceShading> shadings;
  /// (slots) The first site that sees a surface, S where none does: hits are large, and whether
  /// there is one is asked several times a frame.
  std::vector<std::uint16_t> first_site;

  /// S of a slot.
  std::size_t num_sites(std::size_t slot) const { return first_hit[slot + 1] - first_hit[slot]; }
  bool sees_surface(std::size_t slot) const { return first_site[slot] < num_sites(slot); }
  /// The first hit of a pixel that is a surface; it must see one.
  const SurfaceHit& first_surface(std::size_t slot) const {
    return hits[first_hit[slot] + first_site[slot]];
  }
  /// Whether a pixel is a catcher's of shadows (catcher.h): the one place that says so. Its sites
  /// see catchers or objects, never both.
  bool sees_catcher(std::size_t slot) const {
    return sees_surface(slot) && first_surface(slot).is_catcher;
  }
  std::span<const SurfaceHit> pixel(std::size_t slot) const { return part(hits, slot); }
  std::span<const Ray> pixel_rays(std::size_t slot) const { return part(rays, slot); }
  /// Textures at the hits of a pixel's sites; empty where the scene has no detail.
  std::span<const SurfaceShading> pixel_shadings(std::size_t slot) const {
    return shadings.empty() ? std::span<const SurfaceShading>() : part(shadings, slot);
  }
  /// Textures at hit number `at`, or null.
  const SurfaceShading* shading(std::size_t at) const {
    return shadings.empty() ? nullptr : &shadings[at];
  }
  std::size_t size_bytes() const {
    return size_bytes(hits.size(), !shadings.empty()) + first_site.size();
  }
  /// Memory of so many sites.
  static std::size_t size_bytes(std::size_t num_sites, bool has_detail) {
    return num_sites *
           (sizeof(SurfaceHit) + sizeof(Ray) + (has_detail ? sizeof(SurfaceShading) : 0));
  }

 private:
  template <class T>
  std::span<const T> part(const std::vector<T>& all, std::size_t slot) const {
    return std::span(all).subspan(first_hit[slot], num_sites(slot));
  }
};

/// What the tiles of this process saw last, by frame index and tile, where things move: the next
/// frame asks for it again, and tracing it a second time is the same work with the same result.
class SurfaceCache : public StepKeep<std::pair<Step, std::int32_t>, TileSurfaces> {
 public:
  using StepKeep::StepKeep;
};

/// Pass 1: one primary ray for each site of each pixel (SiteRays).
TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                           std::int32_t round = 0);
/// Traces the primary rays of some pixels of a tile. counts: S of each pixel of the tile, row by
/// row (fine_sites.h); empty: image.sites for all. surfaces: any, is replaced; its memory is used
/// again.
void trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                   RoundPixels pixels, std::int32_t round, std::span<const std::uint16_t> counts,
                   TileSurfaces& surfaces);

/// What some pixels of a tile see, of what all of them do.
TileSurfaces part_of(const TileSurfaces& whole, RoundPixels pixels);

/// What rays of pixels see that follow each other; hits are the same as of a whole tile.
/// num_sites: (pixels) S of each.
void trace_primary_rays(const FrameGeometry& geometry, std::span<const Ray> rays,
                        std::span<const std::uint16_t> num_sites, std::span<SurfaceHit> hits);

/// Adds up what the sites of a pixel that see no surface show of the environment, as a share of all
/// its sites. hits, rays: (S).
class EnvironmentBehind {
 public:
  /// radiance: (pixels), is added to.
  EnvironmentBehind(const EnvironmentView& environment, std::span<Rgb> radiance)
      : environment_(environment), radiance_(radiance) {}
  void add(std::size_t pixel, std::span<const SurfaceHit> hits, std::span<const Ray> rays);
  /// Must be called at the end.
  void flush();

 private:
  static constexpr std::size_t kBatch = 64;
  const EnvironmentView& environment_;
  std::span<Rgb> radiance_;
  std::array<float, kBatch> x_, y_, z_, share_;
  std::array<std::size_t, kBatch> pixel_;
  std::size_t count_ = 0;
};

}  // namespace baton
