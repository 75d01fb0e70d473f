#include "worker/method/ratio/ratio_method.h"

#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/ratio/ratio_kernels.h"

namespace baton {

PixelDiagnostics RatioMethod::sample(const PixelInput& input, const PixelState& pixel,
                                     SamplerScratch& scratch, RayWriter& rays) const {
  const kernels::CandidateSource candidates =
      candidate_source(input, candidate_counts(input.sites, num_candidates_, lobe_fraction_));
  const float total =
      kernels::choose_ratio_rays(candidates, Rng(input.key, PassId::choose).uniforms(0, 0)[0],
                                 num_rays_, scratch.choice, scratch.rays);
  return settle(total, candidates, PixelSource::fresh, input, pixel, scratch, rays);
}

}  // namespace baton
