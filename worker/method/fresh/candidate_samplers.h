#pragma once

#include "worker/method/weighted/pixel_samples.h"

namespace baton {

using kernels::CandidateCounts;

/// `total` candidates of which `brdf_fraction` (rounded) come from the BRDF.
CandidateCounts split_candidates(std::int32_t total, float brdf_fraction);

/// `total` candidates of which up to `lobe_fraction` come from the lobes of glossy surfaces, in
/// proportion to what the pixel reflects there; 1: all from the whole BRDF.
CandidateCounts candidate_counts(const SiteBlock& sites, std::int32_t total, float lobe_fraction);

/// Makes a pixel one that no light reaches: no contribution, whatever the directions.
void set_dark(const PixelSamples& samples);

/// Every candidate is a sample: `environment`, `brdf` and, with both counts positive, `mis`
/// (balance heuristic).
class DirectSampler final : public FreshSampler {
 public:
  explicit DirectSampler(CandidateCounts counts) : counts_(counts) {}
  PixelDiagnostics sample(const PixelInput& input, const PixelSamples& samples) override;

 private:
  CandidateCounts counts_;
  kernels::CandidateSet candidates_;
};

/// Sampling-importance-resampling from the product [Burke et al. 2005]: N of M candidates, chosen
/// systematically with probability proportional to their weights. Unbiased for any M and N. The
/// M candidates are split by candidate_counts().
class BidirectionalSampler final : public FreshSampler {
 public:
  BidirectionalSampler(std::int32_t num_candidates, float lobe_fraction)
      : num_candidates_(num_candidates), lobe_fraction_(lobe_fraction) {}
  PixelDiagnostics sample(const PixelInput& input, const PixelSamples& samples) override;

 private:
  std::int32_t num_candidates_;
  float lobe_fraction_;
  kernels::ChoiceScratch choice_;
};

}  // namespace baton
