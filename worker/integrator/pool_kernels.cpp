#include "worker/integrator/pool_kernels.h"

#include <algorithm>
#include <optional>

#include "common/base/check.h"
#include "common/math/low_discrepancy.h"
#include "worker/sampling/pool.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/pool_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/pool-inl.h"

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ChoosePoolRays);

namespace kernels {

float choose_pool_rays(const SiteBlock& sites, const EnvironmentView& environment,
                       const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                       float u, std::int32_t num_rays, std::span<const VisibilityCell> memory,
                       PoolScratch& scratch, PixelRays& out) {
  check_counts(sites, counts);
  BATON_CHECK(num_rays >= 1 && num_rays <= static_cast<std::int32_t>(limits::kMaxParticles));
  BATON_CHECK(memory.size() == kVisibilityCells);
  out.clear();
  if (pool.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChoosePoolRays)(sites, environment, pool, counts, rng, u, num_rays,
                                              memory, scratch, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
