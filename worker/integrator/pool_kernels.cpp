#include "worker/integrator/pool_kernels.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "common/base/check.h"
#include "common/math/low_discrepancy.h"
#include "worker/sampling/pool.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/pool_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/pool-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {

void GatherPool(const kernels::PoolInput& input, const PoolSettings& settings, const Rng& rng,
                std::array<kernels::PoolHalf, 2>& out) {
  PoolGatherer(input, settings).Gather(rng, out);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(GatherPool);

namespace kernels {

void gather_pool(const PoolInput& input, const PoolSettings& settings, const Rng& rng,
                 std::array<PoolHalf, 2>& out) {
  BATON_CHECK(input.sites.num_hits > 0 && settings.num_carried % 2 == 0);
  BATON_CHECK(input.counts.total() >= 1 && 2 * input.counts.total() <= limits::kMaxCandidates);
  BATON_CHECK(!input.counts.lobe_only || input.counts.from_bsdf == 0 || input.sites.num_lobes > 0);
  BATON_CHECK(input.memory.empty() || input.memory.size() == kVisibilityCells);
  if (input.light_pool.empty()) {
    for (PoolHalf& half : out) {
      half.count = 0;
      half.lns = half.lns_fresh = half.visible = half.carry_total = half.ray_total = 0;
      half.visible_color = {};
    }
    return;
  }
  HWY_DYNAMIC_DISPATCH(GatherPool)(input, settings, rng, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
