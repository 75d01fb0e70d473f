#include "worker/method/pool/pool_kernels.h"

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/pool/pool_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/light/choice-inl.h"
#include "worker/sampling/pool-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {

/// A pixel's candidates for PoolStep.
struct PixelCandidates {
  const kernels::CandidateSource& from;
  kernels::CandidateSet& from_bsdf_set;
  std::int32_t from_light = from.counts.from_light, from_bsdf = from.counts.from_bsdf;
  float mean_radiance = from.presampled.mean_radiance;

  template <class Line>
  HWY_INLINE void Weigh(Line& line) const {
    WeighCandidates(from, from_bsdf_set, line);
  }
  ChosenCandidates Chosen() const { return {from, from_bsdf_set}; }
};

inline float ChoosePoolRays(const PoolTuning& tuning, const kernels::CandidateSource& from, float u,
                            std::int32_t num_rays, const PixelVisibility& memory,
                            kernels::PoolScratch& scratch, PixelRays& out) {
  const PixelCandidates candidates{from, scratch.from_bsdf};
  return PoolStep(tuning, candidates, u, num_rays, memory, scratch.lines, out);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ChoosePoolRays);

namespace kernels {

float choose_pool_rays(const PoolTuning& tuning, const CandidateSource& from, float u,
                       std::int32_t num_rays, const PixelVisibility& memory, PoolScratch& scratch,
                       PixelRays& out) {
  check_source(from);
  BATON_CHECK(num_rays >= 1 && num_rays <= static_cast<std::int32_t>(limits::kMaxParticles));
  out.clear();
  if (from.presampled.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChoosePoolRays)(tuning, from, u, num_rays, memory, scratch, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
