#pragma once

#include "common/state/pixel_memory.h"
#include "worker/method/chosen/chosen_rays.h"
#include "worker/method/pool/pool_kernels.h"
#include "worker/sampling/pool_tuning.h"

namespace baton {

/// `pool`: fresh candidates, and rays where the pixel's memory of earlier rays leaves their
/// visibility uncertain (sampling/pool.h). What is known stands in for the rest as control
/// variate. Unbiased whatever the memory says. It carries no samples, only the memory.
class PoolSampler final : public ChosenRaysSampler {
 public:
  /// remembers: its states have memories.
  PoolSampler(const SamplingSpec& spec, bool remembers, const PoolTuning& tuning = {})
      : ChosenRaysSampler(spec), remembers_(remembers), tuning_(tuning) {}
  void look_ahead(const RoundLight& light, bool has_history, const PixelState& pixel) override;
  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                          RayWriter& rays) override;
  void learn(const FoundRays& found, const PixelState& pixel) override;

  /// The noise of the pixel that was sampled last, as its candidates show it.
  const LightVariance& light_variance_seen() const { return rays_.light_variance; }

 private:
  PixelMemory* memory_of(const PixelState& pixel) const;

  bool remembers_;
  PoolTuning tuning_;
  kernels::PoolScratch scratch_;
};

PixelMethod make_pool_method(const JobSpec& job, const PoolTuning& tuning = {});

}  // namespace baton
