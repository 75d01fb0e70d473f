#pragma once

#include "common/state/block_memory.h"
#include "worker/method/chosen/chosen_rays.h"
#include "worker/method/pool/pool_kernels.h"
#include "worker/sampling/pool_tuning.h"

namespace baton {

/// `pool`: fresh candidates, and rays where the memory of earlier rays of the pixel's block leaves
/// their visibility uncertain (sampling/pool.h). What is known stands in for the rest as control
/// variate. Unbiased whatever the memory says: a round reads what those before it have left. It
/// carries no samples, only the memory.
class PoolSampler final : public ChosenRaysSampler {
 public:
  /// remembers: its states have memories.
  PoolSampler(const SamplingSpec& spec, bool remembers, const PoolTuning& tuning = {})
      : ChosenRaysSampler(spec), remembers_(remembers), tuning_(tuning) {}
  void begin_round(const SampleState& /*state*/, bool /*goes_on*/) override { has_table_ = false; }
  void look_ahead(const RoundLight& light, bool has_history, const PixelState& pixel) override;
  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                          RayWriter& rays) override;
  void learn(const FoundRays& found, const PixelState& pixel) override;

  /// The noise of the pixel that was sampled last, as its candidates show it.
  const LightVariance& light_variance_seen() const { return rays_.light_variance; }

 private:
  static BlockMemory& memory_of(const PixelState& pixel);
  const VisibilityTable& table_of(const PixelState& pixel);

  bool remembers_;
  PoolTuning tuning_;
  /// What the block of the pixel that was sampled last expects. All pixels of a block are sampled
  /// before any of them learns.
  VisibilityTable table_;
  const BlockMemory* table_is_of_ = nullptr;
  bool has_table_ = false;
  kernels::PoolScratch scratch_;
};

PixelMethod make_pool_method(const JobSpec& job, const PoolTuning& tuning = {});

}  // namespace baton
