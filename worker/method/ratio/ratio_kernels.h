#pragma once

#include "worker/light/candidates.h"
#include "worker/sampling/pixel_rays.h"

namespace baton::kernels {

/// Draws candidates like draw_candidates, chooses N of them like choose_candidates and makes them
/// the rays of the ratio estimator [Heitz, Hill & McGuire 2018]: what all candidates reflect
/// together, per channel, times the share of the chosen ones' colours that is free. A candidate
/// that is chosen twice is traced once. num_rays: N, [1, kMaxParticles]. Returns the sum of the
/// weights, an unbiased estimate of Lns; when it is not positive and finite, out is empty.
float choose_ratio_rays(const CandidateSource& from, float u, std::int32_t num_rays,
                        ChoiceScratch& scratch, PixelRays& out);

}  // namespace baton::kernels
