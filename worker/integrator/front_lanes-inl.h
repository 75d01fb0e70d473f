// Moving the wanted lanes of a vector to its front. Included once per Highway target.
#if defined(BATON_WORKER_INTEGRATOR_FRONT_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_INTEGRATOR_FRONT_LANES_INL_H_
#undef BATON_WORKER_INTEGRATOR_FRONT_LANES_INL_H_
#else
#define BATON_WORKER_INTEGRATOR_FRONT_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include "common/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Where each lane comes from when those of `mask` move to the front; kept: how many they are.
/// (Highway 1.0's Compress copies its table of permutations at every call.)
HWY_INLINE auto FrontLanes(MF mask, std::size_t& kept) {
  const DF d;
  const DI di;
  HWY_ALIGN std::int32_t is_kept[hn::MaxLanes(DI())];
  HWY_ALIGN std::int32_t from[hn::MaxLanes(DI()) + 1] = {};
  hn::Store(hn::VecFromMask(di, hn::RebindMask(di, mask)), di, is_kept);
  kept = 0;
  for (std::size_t lane = 0; lane < hn::Lanes(di); ++lane) {
    from[kept] = static_cast<std::int32_t>(lane);
    kept -= static_cast<std::size_t>(std::int64_t{is_kept[lane]});
  }
  return hn::IndicesFromVec(d, hn::Load(di, from));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
