#pragma once

#include <algorithm>
#include <cmath>

namespace baton {

/// The arithmetic of the pool sampler. Particles (u_j, w_j) of the frame before and M fresh
/// candidates y_i ~ q meet under the balance m_old(w) = c p_before(w) / (c p_before(w) + p_now(w)):
/// wherever one of them has little to say the other one speaks. The weights are at most c u_j and
/// p_now / (M q); the sum over both has the expectation of p_now's integral for every c that does
/// not depend on the particles. An estimated normalising constant must not enter. So c is a
/// function of map and surfaces: the job's gain, less where the light or a lobe has changed
/// (FrameLight::gain, lobe_kinship), as few particles in a new place make more noise than fresh
/// candidates do.

/// Weight of a carried particle of contribution u: m_old p_now / p_before u. gain: c > 0. Targets
/// >= 0.
inline float carried_weight(float gain, float target_before, float target_now, float u) {
  if (!(target_before > 0)) return 0;
  return gain * target_now / (gain * target_before + target_now) * u;
}

/// Weight of a fresh candidate: (1 - m_old) p_now / (M q). gain 0: there are no carried particles.
/// proposal: M q, > 0 wherever target_now is.
inline float fresh_weight(float gain, float target_before, float target_now, float proposal) {
  if (!(target_now > 0 && proposal > 0)) return 0;
  return target_now / (gain * target_before + target_now) * (target_now / proposal);
}

/// The estimate of the share of free rays V^ steers two choices, neither of which it can bias:
/// which particles are carried and which directions get a ray. Both factors are standard
/// deviations, so that each choice is the one of least variance.

/// Factor on the weight for carrying: sqrt(E[V^2]) = sqrt(V^), as a pixel is a sum of V. Light that
/// will be blocked needs few particles. In [kLeastHope, 1].
inline constexpr float kLeastHope = 0.2f;
inline float carry_factor(float free) { return std::max(std::sqrt(free), kLeastHope); }

/// Factor on the weight for a ray: sqrt(E[(V - V^)^2]) = sqrt(V^ (1 - V^)), as V^ itself is a
/// control variate. What is known needs few rays. In [kLeastDoubt, 1/2].
inline constexpr float kLeastDoubt = 0.02f;
inline float ray_factor(float free) { return std::max(std::sqrt(free * (1 - free)), kLeastDoubt); }

/// Whether rays are chosen by doubt, with the control variate. That subtracts what was expected of
/// a blocked ray, and falls below zero where light that was sure to come is blocked: it is used
/// where the expected light is so many times the weight of doubt that the stability suite saw 87
/// such values among a hundred million. Elsewhere rays are chosen by carry_factor, and each counts
/// what it brings. Either way is without bias: pool and memory decide before any ray is chosen.
inline constexpr float kSafeControl = 4;
inline bool use_control(float expected, float doubt) { return expected > kSafeControl * doubt; }

}  // namespace baton
