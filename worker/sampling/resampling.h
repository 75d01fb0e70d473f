#pragma once

#include <cstdint>
#include <span>

#include "common/job/job_spec.h"
#include "common/math/philox.h"

namespace baton {

/// Chooses ancestors[m] in [0, N) for m in [0, K) such that particle j has K * weights[j] offspring
/// in expectation [Douc & Cappe 2005]. weights: (N,) non-negative, sum 1 to float accuracy.
/// ancestors: (K,), ascending for all schemes but `residual`. rng: addressed randomness of the
/// pixel; `step` sets this use apart from others.
///   systematic   one uniform u, positions (m + u) / K
///   stratified   a uniform for each stratum
///   multinomial  K independent uniforms, sorted
///   residual     floor(K w_j) copies each, the rest multinomial in what is left
void resample(ResamplingScheme scheme, std::span<const float> weights,
              std::span<std::int32_t> ancestors, const Rng& rng, std::uint32_t step);

}  // namespace baton
