// Presampled light in SIMD. Included once per Highway target.
#if defined(BATON_WORKER_LIGHT_PRESAMPLED_LIGHT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_LIGHT_PRESAMPLED_LIGHT_INL_H_
#undef BATON_WORKER_LIGHT_PRESAMPLED_LIGHT_INL_H_
#else
#define BATON_WORKER_LIGHT_PRESAMPLED_LIGHT_INL_H_
#endif

#include <hwy/highway.h>

#include "worker/light/presampled_light.h"
#include "worker/surface/bsdf-inl.h"
#include "worker/surface/environment-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A vector of entries of the presampled light.
struct LightLanes {
  VU code;
  Vec3Lanes direction;
  RadianceLanes now;
  VF inverse_density;
};
/// Entries entry, entry + 1, ..., which lie in one block.
HWY_INLINE LightLanes LoadLight(const PresampledLight& presampled, std::size_t entry) {
  const DF d;
  const PresampledLight::Block& block = presampled.blocks[entry / PresampledLight::kBlock];
  const std::size_t at = entry % PresampledLight::kBlock;
  return {hn::Load(DU(), block.code + at),
          {hn::Load(d, block.x + at), hn::Load(d, block.y + at), hn::Load(d, block.z + at)},
          {hn::Load(d, block.r + at), hn::Load(d, block.g + at), hn::Load(d, block.b + at),
           hn::Load(d, block.density + at)},
          hn::Load(d, block.inverse_density + at)};
}
/// Radiance of the same entries in the frame before; the presampled light must have it.
HWY_INLINE Vec3Lanes LoadLightBefore(const PresampledLight& presampled, std::size_t entry) {
  const DF d;
  const PresampledLight::Before& block = presampled.before[entry / PresampledLight::kBlock];
  const std::size_t at = entry % PresampledLight::kBlock;
  return {hn::Load(d, block.r + at), hn::Load(d, block.g + at), hn::Load(d, block.b + at)};
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
