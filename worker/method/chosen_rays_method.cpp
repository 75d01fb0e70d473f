#include "worker/method/chosen_rays_method.h"

#include <cmath>

namespace baton {

PixelDiagnostics ChosenRaysMethod::settle(float total, const kernels::CandidateSource& candidates,
                                          PixelSource source, const PixelInput& input,
                                          const PixelState& pixel, SamplerScratch& scratch,
                                          RayWriter& rays) const {
  rays.add(scratch.rays);
  SampleState& state = pixel.tile;
  const bool lit = total > 0 && std::isfinite(total);
  // Rays are few where little is expected of them, and say little of the light that is blocked.
  if (input.wants_unshadowed && lit)
    rays.known.unshadowed = kernels::reflected_light(candidates, scratch.candidates);
  state.lns[pixel.index] = state.lns_fresh[pixel.index] = lit ? total : 0.0f;
  state.source[pixel.index] = source;
  return {.ess = lit ? static_cast<float>(num_rays_) : 0.0f,
          .num_samples = num_rays_,
          .target_evaluations = candidates.counts.total()};
}

}  // namespace baton
