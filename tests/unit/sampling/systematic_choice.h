#pragma once

#include <cstdint>
#include <span>

namespace baton {

/// What RunningSums and SystematicPicks (worker/sampling/systematic-inl.h) do, for tests:
/// systematic choice of K from M unnormalised weights: each is chosen K weight / total times in
/// expectation, rounded down or up. The weights lie on the line by lanes of a vector (first those
/// at 0, 8, 16, ..., then those at 4, 12, ..., then at 2, 6, 1, 5, 3, 7 and so on), which lets
/// eight walk along it at once.
///
/// weights: (M,) non-negative, their sum positive and finite. u: uniform in [0, 1). chosen: (K,),
/// 1 <= K <= limits::kMaxParticles. A weight of zero is never chosen.
void systematic_choice(std::span<const float> weights, float u, std::span<std::int32_t> chosen);

}  // namespace baton
