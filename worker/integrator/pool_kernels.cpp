#include "worker/integrator/pool_kernels.h"

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/pool_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/choice-inl.h"
#include "worker/sampling/pool-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {

/// A pixel's candidates for PoolStep.
struct PixelCandidates {
  const SiteBlock& sites;
  const EnvironmentView& environment;
  const LightPool& pool;
  const kernels::CandidateCounts& counts;
  const Philox4x32::Counter random;
  kernels::CandidateSet& from_bsdf_set;
  std::int32_t from_light = counts.from_light, from_bsdf = counts.from_bsdf;
  float mean_radiance = pool.mean_radiance;

  template <class Line>
  HWY_INLINE void Weigh(Line& line) const {
    WeighCandidates(sites, environment, pool, counts, random, from_bsdf_set, line);
  }
  ChosenCandidates Chosen() const { return {sites, pool, counts, random, from_bsdf_set}; }
};

inline float ChoosePoolRays(const PoolTuning& tuning, const SiteBlock& sites,
                            const EnvironmentView& environment, const LightPool& pool,
                            const kernels::CandidateCounts& counts, const Rng& rng, float u,
                            std::int32_t num_rays, const PixelMemory& memory,
                            kernels::PoolScratch& scratch, PixelRays& out) {
  const PixelCandidates candidates{sites,  environment,    pool,
                                   counts, rng.bits(0, 0), scratch.from_bsdf};
  return PoolStep(tuning, candidates, u, num_rays, memory, scratch.lines, out);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ChoosePoolRays);

namespace kernels {

float choose_pool_rays(const PoolTuning& tuning, const SiteBlock& sites,
                       const EnvironmentView& environment, const LightPool& pool,
                       const CandidateCounts& counts, const Rng& rng, float u,
                       std::int32_t num_rays, const PixelMemory& memory, PoolScratch& scratch,
                       PixelRays& out) {
  check_counts(sites, counts);
  BATON_CHECK(num_rays >= 1 && num_rays <= static_cast<std::int32_t>(limits::kMaxParticles));
  out.clear();
  if (pool.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChoosePoolRays)(tuning, sites, environment, pool, counts, rng, u,
                                              num_rays, memory, scratch, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
