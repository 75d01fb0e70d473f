#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/base/limits.h"

namespace baton {

/// The arithmetic of the pool sampler. A pixel's M fresh candidates y_i have weights w_i, which sum
/// to Lns; its memory of earlier rays guesses V^, the share of free rays around each. V^ steers
/// which candidates get a ray and how many, and it cannot bias: candidates and memory decide before
/// any ray is chosen, and each ray is divided by the factor that chose it. Each factor is the
/// standard deviation of what is left to find out, so that the choice is the one of least variance.

/// Factor on the weight where rays count what they bring: sqrt(E[V^2]) = sqrt(V^), as a pixel is a
/// sum of V. In [kLeastHope, 1].
inline constexpr float kLeastHope = 0.2f;
inline float hope_factor(float free) { return std::max(std::sqrt(free), kLeastHope); }

/// Factor on the weight where V^ is a control variate: sqrt(E[(V - V^)^2]) = sqrt(V^ (1 - V^)).
/// What is known needs few rays. In [kLeastDoubt, 1/2].
inline constexpr float kLeastDoubt = 0.05f;
inline float doubt_factor(float free) {
  return std::max(std::sqrt(free * (1 - free)), kLeastDoubt);
}

/// Whether V^ is the control variate. That subtracts what was expected of a blocked ray, and can
/// fall below zero where light that was sure to come is blocked, as no unbiased estimator that
/// gives sure light fewer rays than its share is free of: it is used where the expected light is
/// twice the weight of doubt. Where little light is expected rays count what they bring. expected:
/// sum of w V^. doubt: sum of w doubt_factor(V^).
inline constexpr float kSafeControl = 2;
inline bool use_control(float expected, float doubt) { return expected > kSafeControl * doubt; }

/// Rays of a pixel with a memory: N where the standard deviation of what is in doubt is 2.5 % of
/// `scale`, else in proportion to its power of 3/4, from N / 2 to most_rays(N). scale:
/// noise_scale(), > 0. (In proportion to doubt itself would be best if memories were right.)
inline constexpr float kUsualDoubt = 0.025f;
inline std::int32_t most_rays(std::int32_t num_rays) {
  return std::min<std::int32_t>(limits::kMostPoolRays * num_rays, limits::kMaxParticles);
}
inline std::int32_t rays_for_doubt(std::int32_t num_rays, float doubt, float scale) {
  const float root = std::sqrt(doubt / (kUsualDoubt * scale));
  const float share = std::clamp(root * std::sqrt(root), 0.5f, float{limits::kMostPoolRays});
  const auto wanted = static_cast<std::int32_t>(std::ceil(share * static_cast<float>(num_rays)));
  return std::min(wanted, most_rays(num_rays));
}

}  // namespace baton
