#pragma once

#include "worker/method/chosen_rays_method.h"
#include "worker/sampling/pool_tuning.h"

namespace baton {

/// `pool`: fresh candidates, and rays where the pixel's memory of earlier rays leaves their
/// visibility uncertain (sampling/pool.h). What is known stands in for the rest as control
/// variate. Unbiased whatever the memory says. It carries no samples, only the memory.
class PoolMethod final : public ChosenRaysMethod {
 public:
  explicit PoolMethod(const SamplingSpec& spec, const PoolTuning& tuning = {})
      : ChosenRaysMethod(spec), tuning_(tuning) {}
  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel, SamplerScratch& scratch,
                          RayWriter& rays) const override;
  void learn(const FoundRays& found, const PixelState& pixel) const override;

 private:
  PoolTuning tuning_;
};

}  // namespace baton
