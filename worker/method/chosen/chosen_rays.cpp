#include "worker/method/chosen/chosen_rays.h"

#include <cmath>

#include "common/base/poison.h"
#include "common/state/sample_planes.h"

namespace baton {

PixelDiagnostics ChosenRaysSampler::write_chosen(float total,
                                                 const kernels::CandidateSource& candidates,
                                                 PixelSource source, const PixelInput& input,
                                                 const PixelState& pixel, RayWriter& rays) {
  rays.add(rays_);
  const bool lit = total > 0 && std::isfinite(total);
  // Rays are few where little is expected of them, and say little of the light that is blocked.
  if (input.wants_unshadowed && lit) {
    poison(unshadowed_);
    rays.known.unshadowed = kernels::reflected_light(candidates, unshadowed_);
  }
  const float lns = lit ? total : 0.0f;
  const SamplePlanes planes(pixel.tile);
  planes.lns[pixel.index] = planes.lns_fresh[pixel.index] = lns;
  pixel.tile.set_source(pixel.index, source);
  return {.lns = lns,
          .ess = lit ? static_cast<float>(num_rays_) : 0.0f,
          .num_samples = num_rays_,
          .target_evaluations = candidates.counts.total()};
}

}  // namespace baton
