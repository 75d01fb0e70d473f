#include "worker/method/chosen_rays_method.h"

#include <cmath>

namespace baton {

PixelDiagnostics ChosenRaysMethod::settle(float total, std::int32_t num_candidates,
                                          PixelSource source, const PixelRays& chosen,
                                          const PixelState& pixel, RayWriter& rays) const {
  rays.add(chosen);
  SampleState& state = pixel.tile;
  const bool lit = total > 0 && std::isfinite(total);
  state.lns[pixel.index] = state.lns_fresh[pixel.index] = lit ? total : 0.0f;
  state.source[pixel.index] = source;
  return {.ess = lit ? static_cast<float>(num_rays_) : 0.0f,
          .num_samples = num_rays_,
          .target_evaluations = num_candidates};
}

}  // namespace baton
