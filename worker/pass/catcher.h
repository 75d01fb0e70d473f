#pragma once

#include <span>
#include <vector>

#include "worker/light/frame_light.h"
#include "worker/pass/aside.h"
#include "worker/pass/render_context.h"

namespace baton {

/// A ground that catches shadows (GroundSpec::catcher) is in no picture. Where a ray meets no
/// object the ground reflects with the albedo pi / E per channel, E being the unshadowed irradiance
/// of the frame (FrameLight::catcher): what methods estimate of it is the share of the light that
/// arrives, S / U, with all their machinery and without bias. A pixel that sees an object, too,
/// or has seen one in an earlier round, belongs to that: its sites on the ground are sampled beside
/// it, afresh in each round, so that objects have the same bytes with and without a catcher.

/// Lets rays that meet no object see the ground. sites: of a pixel; those of a pixel follow each
/// other. In pixels that see an object `hit` stays false.
void see_catcher(const JobSpec& job, const FrameGeometry& geometry, std::span<const Ray> rays,
                 std::span<SurfaceHit> hits);

/// Prepares what a pixel carries for what it sees now: the ground does not start from an object's
/// memory, nor an object from the ground's. Returns whether it starts from what is there.
bool takes_up(bool sees_catcher, SampleState& state, std::size_t index);
/// Whether the pixel's memory is an object's.
bool belongs_to_object(const SampleState& state, std::size_t index);

/// The sites on the ground of a pixel that belongs to an object.
class CatcherEdge {
 public:
  /// The share of the light that arrives, times that of the sites. input: the pixel's own.
  Rgb sample(const PixelMethod& method, const PixelInput& input, const FrameLight& light,
             const SampleState& like, SamplerScratch& scratch);

 private:
  std::vector<SurfaceHit> hits_;
  SiteBlock sites_;
  AsideSampler aside_;
};

}  // namespace baton
