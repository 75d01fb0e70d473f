#pragma once

#include "worker/integrator/pixel_sampler.h"

namespace baton {

/// The pool sampler: carried particles and fresh candidates in one pool under a balance that
/// neither drifts nor loses a light (sampling/pool.h). Particles turn with the environment. What
/// rays found in earlier frames steers which directions get this frame's rays and stands in for the
/// rest as control variate: unbiased whatever it says. The particles are two halves that never
/// exchange samples; each gives an estimate of the pixel.
class PoolSampler final : public PixelSampler {
 public:
  explicit PoolSampler(const SamplingSpec& spec);
  PixelDiagnostics sample(const PixelInput& input, SamplerScratch& scratch,
                          const PixelSamples& samples) const override;
  void choose_rays(const PixelInput& input, SamplerScratch& scratch,
                   PixelRays& rays) const override;
  bool chooses_rays() const override { return true; }
  bool remembers() const override { return remembers_; }

 private:
  PoolSettings settings_;
  std::int32_t half_candidates_;
  float lobe_fraction_;
  std::size_t num_rays_;
  bool remembers_;
};

}  // namespace baton
