#pragma once

#include <memory>
#include <vector>

#include "common/job/plan/sequence.h"
#include "worker/accel/geometry_sequence.h"
#include "worker/light/frame_light.h"
#include "worker/method/pixel_method.h"
#include "worker/pass/catcher_albedo.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

class SurfaceCache;

/// See tile_renderer.h. Immutable but for lights, geometry and surfaces, which are prepared frame
/// by frame on demand and guard themselves.
class RenderContext {
 public:
  JobSpec job;
  Digest picture;  ///< picture_digest of the job
  TileGrid grid{{0, 0, 1, 1}, 1};
  std::vector<FrameSpec> frames;
  std::shared_ptr<const Scene> scene;
  std::unique_ptr<GeometrySequence> geometry;
  PixelMethod method;
  /// (materials), which have no `start` where `method` samples them.
  std::vector<PixelMethod> own_methods;
  std::unique_ptr<LightSequence> lights;
  /// Surfaces of the last frames, where things move.
  std::shared_ptr<SurfaceCache> surfaces;
};

/// The surfaces of one pixel, which its sites hit in that frame, with their materials; looks: of
/// the hits, or none: then textures are looked up; catchers: the albedo of those that catch
/// shadows. Returns the radiance that they emit, the mean over the sites.
Rgb gather_sites(const FrameGeometry& geometry, std::span<const SurfaceHit> hits,
                 std::span<const SurfaceShading> shadings, SiteBlock& sites,
                 CatcherAlbedo& catchers);

}  // namespace baton
