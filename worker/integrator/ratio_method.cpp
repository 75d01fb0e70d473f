#include "worker/integrator/ratio_method.h"

#include "worker/integrator/candidate_samplers.h"
#include "worker/integrator/populations.h"
#include "worker/integrator/ratio_kernels.h"

namespace baton {

RatioMethod::RatioMethod(const SamplingSpec& spec)
    : num_candidates_(spec.num_candidates),
      lobe_fraction_(spec.brdf_fraction),
      num_rays_(spec.num_particles) {}

PixelDiagnostics RatioMethod::sample(const PixelInput& input, const PixelState& pixel,
                                     SamplerScratch& scratch, RayWriter& rays) const {
  const float total = kernels::choose_ratio_rays(
      input.sites, input.now, input.light.pool,
      candidate_counts(input.sites, num_candidates_, lobe_fraction_),
      Rng(input.key, PassId::candidates), Rng(input.key, PassId::choose).uniforms(0, 0)[0],
      num_rays_, scratch.choice, scratch.rays);
  rays.add(scratch.rays);
  return settle_rays(total, num_rays_, num_candidates_, PixelSource::fresh, pixel);
}

}  // namespace baton
