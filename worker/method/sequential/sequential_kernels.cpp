#include "worker/method/sequential/sequential_kernels.h"

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/sequential/sequential_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/method/carried/carried_light.h"
#include "worker/method/sequential/carried_target-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {

SequentialOutcome SequentialPixel(const SiteBlock& sites, const kernels::CarriedLight& light,
                                  const kernels::LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles) {
  const SameSurfaceTarget target{sites, light, located};
  return SequentialStep(target, settings, lns_before, Rng(key, PassId::move),
                        Rng(key, PassId::resample), particles);
}

SequentialOutcome SequentialMovedPixel(const SiteBlock& sites, const OldSurfaces& old,
                                       const kernels::CarriedLight& light,
                                       const kernels::LocatedDirections* located,
                                       const SequentialSettings& settings, float lns_before,
                                       const RngKey& key, ParticleSpan particles) {
  const MovedSurfaceTarget target{{sites, light, located}, old};
  return SequentialStep(target, settings, lns_before, Rng(key, PassId::move),
                        Rng(key, PassId::resample), particles);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(SequentialPixel);
HWY_EXPORT(SequentialMovedPixel);

namespace kernels {

SequentialOutcome sequential_step(const SiteBlock& sites, const OldSurfaces* old,
                                  const CarriedLight& light, const LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles) {
  BATON_CHECK(settings.num_particles >= 1 && settings.num_particles <= limits::kMaxParticles);
  if (light.presampled.empty() || !(lns_before > 0)) return {};
  BATON_CHECK(!light.presampled.before.empty());
  if (old != nullptr) {
    return HWY_DYNAMIC_DISPATCH(SequentialMovedPixel)(sites, *old, light, located, settings,
                                                      lns_before, key, particles);
  }
  return HWY_DYNAMIC_DISPATCH(SequentialPixel)(sites, light, located, settings, lns_before, key,
                                               particles);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
