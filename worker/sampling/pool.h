#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/base/limits.h"
#include "common/math/padded_array.h"
#include "worker/sampling/pool_tuning.h"

namespace baton {

/// The decisions of the pool sampler; its work on a frame is in pool-inl.h. A pixel's M fresh
/// candidates y_i have weights w_i, which sum to Lns; the memory of earlier rays of its block of
/// pixels expects the visibility V^ of each, the share of free rays around it
/// (visibility_table.h). V^ steers which candidates get a ray
/// and how many, and it cannot bias: candidates and memory decide before any ray is chosen, and
/// each ray is divided by the factor that chose it. The factor is the standard deviation of what a
/// ray adds, which is the choice of least variance:
/// - where rays count what they bring, the *contribution* sqrt(E[V^2]) = sqrt(V^);
/// - where V^ is a control variate, its *deviation* sqrt(E[(V - V^)^2]) = sqrt(V^ (1 - V^)).
///   Candidates whose visibility is nearly certain need few rays.
/// Which of the two it is, use_control() decides.

/// Something of every candidate of a pixel: those of the light to the end of their last vector,
/// then those of the BRDF.
using CandidateLine = PaddedArray<float, limits::kMaxCandidates + kVectorPadding>;

/// Work space of a pixel in a frame.
struct PoolLines {
  CandidateLine contribution_sums, deviation_sums;
  /// Bin of BlockMemory that each candidate's direction is in.
  PaddedArray<std::int32_t, limits::kMaxCandidates + kVectorPadding> bins;
};

/// Whether V^ is the control variate. That subtracts what was expected of a blocked ray, and can
/// fall below zero where light that was sure to come is blocked, as no unbiased estimator that
/// gives sure light fewer rays than its share is free of. Where little light is expected rays count
/// what they bring. expected: sum of w V^. deviation: that of V^, weighted alike.
inline bool use_control(const PoolTuning& tuning, float expected, float deviation) {
  return expected > tuning.control_from * deviation;
}

/// Rays of a pixel with a memory: N where the deviation is the usual one beside `scale`, else in
/// proportion to it, to 4 N and kMaxParticles: least variance for a given sum of rays. scale:
/// noise_scale(), > 0.
inline std::int32_t rays_for_deviation(const PoolTuning& tuning, std::int32_t num_rays,
                                       float deviation, float scale) {
  const float share = std::clamp(deviation / (tuning.usual_deviation * scale), tuning.least_rays,
                                 float{limits::kMostPoolRays});
  const auto wanted = static_cast<std::int32_t>(std::ceil(share * static_cast<float>(num_rays)));
  return std::min<std::int32_t>({wanted, limits::kMostPoolRays * num_rays, limits::kMaxParticles});
}

}  // namespace baton
