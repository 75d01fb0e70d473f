#pragma once

#include "worker/light/candidates.h"
#include "worker/sampling/pixel_rays.h"
#include "worker/sampling/pool.h"
#include "worker/sampling/visibility_table.h"

namespace baton::kernels {

/// Work space of choose_pool_rays.
struct PoolScratch {
  PoolLines lines;
  CandidateSet from_bsdf;
};

/// Draws candidates like draw_candidates and chooses the rays of one pixel from them: PoolStep of
/// sampling/pool-inl.h, which says what u, num_rays, memory and the answer are. num_rays: N,
/// [1, kMaxParticles].
float choose_pool_rays(const PoolTuning& tuning, const CandidateSource& from, float u,
                       std::int32_t num_rays, const PixelVisibility& memory, PoolScratch& scratch,
                       PixelRays& out);

}  // namespace baton::kernels
