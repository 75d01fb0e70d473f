#pragma once

#include "worker/integrator/pixel_sampler.h"

namespace baton {

/// The pool sampler: fresh candidates, and rays where the pixel's memory of earlier rays leaves
/// their visibility in doubt (sampling/pool.h). What is known stands in for the rest as control
/// variate. Unbiased whatever the memory says. It carries no samples, only the memory.
class PoolSampler final : public PixelSampler {
 public:
  explicit PoolSampler(const SamplingSpec& spec);
  /// samples: empty but for Lns and source.
  PixelDiagnostics sample(const PixelInput& input, SamplerScratch& scratch,
                          const PixelSamples& samples) const override;
  bool chooses_rays() const override { return true; }
  bool keeps_memory() const override { return true; }

 private:
  std::int32_t num_candidates_;
  float lobe_fraction_;
  std::int32_t num_rays_;
};

}  // namespace baton
