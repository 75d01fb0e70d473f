#pragma once

#include "worker/integrator/pixel_sampler.h"

namespace baton {

/// How many candidates come from the map and how many from the BRDF.
struct CandidateCounts {
  std::int32_t from_light = 0;
  std::int32_t from_bsdf = 0;
  std::int32_t total() const { return from_light + from_bsdf; }
};

/// `total` candidates of which `brdf_fraction` (rounded) come from the BRDF.
CandidateCounts split_candidates(std::int32_t total, float brdf_fraction);

/// Every candidate is a sample: `environment`, `brdf` and, with both counts positive, `mis` (balance heuristic).
class DirectSampler final : public PixelSampler {
 public:
  explicit DirectSampler(CandidateCounts counts) : counts_(counts) {}
  PixelDiagnostics sample(const PixelInput& input, kernels::CandidateSet& scratch,
                          const PixelSamples& samples) const override;

 private:
  CandidateCounts counts_;
};

/// Sampling-importance-resampling from the product [Burke et al. 2005]: N of M candidates, chosen systematically with
/// probability proportional to their weights. Unbiased for any M and N.
class BidirectionalSampler final : public PixelSampler {
 public:
  explicit BidirectionalSampler(CandidateCounts counts) : counts_(counts) {}
  PixelDiagnostics sample(const PixelInput& input, kernels::CandidateSet& scratch,
                          const PixelSamples& samples) const override;

 private:
  CandidateCounts counts_;
};

}  // namespace baton
