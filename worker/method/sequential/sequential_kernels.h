#pragma once

#include "common/math/philox.h"
#include "worker/method/carried/carried_light.h"
#include "worker/method/carried/old_surfaces.h"
#include "worker/sampling/sequential.h"
#include "worker/surface/site_block.h"

namespace baton::kernels {

/// One frame of the sequential sampler for a pixel (sampling/sequential-inl.h). old: the surfaces
/// that the particles come from, by sites of this frame; null where they are `sites`. light.before:
/// the frame that the particles come from, of which the presampled light must have the radiance
/// (PresampledLight::has_before). located: the particles in its maps, or null. lns_before > 0.
SequentialOutcome sequential_step(const SiteBlock& sites, const OldSurfaces* old,
                                  const CarriedLight& light, const LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles);

}  // namespace baton::kernels
