#pragma once

#include "worker/integrator/kernels.h"
#include "worker/integrator/pixel_rays.h"
#include "worker/sampling/visibility_grid.h"

namespace baton::kernels {

/// Work space of choose_pool_rays.
struct PoolScratch {
  CandidateLine hope_sums, doubt_sums;
  CandidateLine free;  ///< V^ of each candidate
  CandidateSet from_bsdf;
};

/// Draws candidates like draw_candidates and chooses the rays of one pixel from them by what its
/// memory says of their directions (sampling/pool.h): systematically, u in [0, 1). A candidate that
/// is chosen twice is traced once. memory: (kVisibilityCells), as the frames before left it, all 0
/// where there is none. num_rays: N, [1, kMaxParticles]; with a memory a pixel gets N / 2 to 4 N
/// rays, at most kMaxParticles (rays_for_doubt).
/// Returns the sum of the weights, an unbiased estimate of Lns; when it is not positive and finite,
/// out is empty.
float choose_pool_rays(const SiteBlock& sites, const EnvironmentView& environment,
                       const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                       float u, std::int32_t num_rays, std::span<const VisibilityCell> memory,
                       PoolScratch& scratch, PixelRays& out);

}  // namespace baton::kernels
