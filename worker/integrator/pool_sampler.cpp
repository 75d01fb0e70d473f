#include "worker/integrator/pool_sampler.h"

#include <array>

#include "worker/integrator/candidate_samplers.h"
#include "worker/sampling/light_noise.h"

namespace baton {

PoolSampler::PoolSampler(const SamplingSpec& spec)
    : num_candidates_(spec.num_candidates),
      lobe_fraction_(spec.brdf_fraction),
      num_rays_(spec.num_particles) {}

PixelDiagnostics PoolSampler::sample(const PixelInput& input, SamplerScratch& scratch,
                                     const PixelSamples& samples) const {
  static constexpr std::array<VisibilityCell, kVisibilityCells> kNothing{};
  const std::span<const VisibilityCell> memory = input.memory.empty() ? kNothing : input.memory;
  const std::int32_t num_candidates =
      candidates_for_noise(num_candidates_, light_variance(memory), limits::kMaxCandidates);
  const float total = kernels::choose_pool_rays(
      input.sites, input.now, input.light.pool,
      candidate_counts(input.sites, num_candidates, lobe_fraction_),
      Rng(input.key, PassId::candidates), Rng(input.key, PassId::choose).uniforms(0, 0)[0],
      num_rays_, memory, scratch.pool, scratch.rays);
  const auto source = input.has_history ? PixelSource::carried : PixelSource::fresh;
  return settle_rays(total, num_rays_, num_candidates, source, samples);
}

}  // namespace baton
