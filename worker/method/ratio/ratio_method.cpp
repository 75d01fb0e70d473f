#include "worker/method/ratio/ratio_method.h"

#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/ratio/ratio_kernels.h"

namespace baton {

PixelDiagnostics RatioMethod::sample(const PixelInput& input, const PixelState& pixel,
                                     SamplerScratch& scratch, RayWriter& rays) const {
  const float total = kernels::choose_ratio_rays(
      candidate_source(input, candidate_counts(input.sites, num_candidates_, lobe_fraction_)),
      Rng(input.key, PassId::choose).uniforms(0, 0)[0], num_rays_, scratch.choice, scratch.rays);
  return settle(total, num_candidates_, PixelSource::fresh, scratch.rays, pixel, rays);
}

}  // namespace baton
