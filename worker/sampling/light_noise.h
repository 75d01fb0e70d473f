#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "worker/sampling/visibility_grid.h"

namespace baton {

/// How many candidates a pixel gets, by what it remembers of the noise of its light. On glossy
/// surfaces a few pixels have most of the error of a picture: those that see a lamp at the rim of
/// their lobe. The candidates of one frame do not tell soon enough, and a number that depends on
/// their own values would be bias; what earlier frames saw of the pixel is free of it.

/// What noise is compared with: a pixel's light and that of its surroundings, three times the mean
/// radiance of the environment, so that pixels that are dark among bright ones may be noisier.
inline constexpr float kSurroundings = 3;
inline float noise_scale(float light, float mean_radiance) {
  return light + kSurroundings * mean_radiance;
}

/// Variance of a pixel's light, in squares of noise_scale(), that one candidate of each kind would
/// have; 0: nothing is known. Kinds are apart because they do not help each other: to a mirror that
/// sees a lamp only candidates from its lobe are of use.
struct LightVariance {
  float from_light = 0;  ///< candidates from the environment's pool
  float from_lobes = 0;  ///< candidates from glossy lobes
};

/// A cell holds the upper half of a float.
inline LightVariance light_variance(std::span<const VisibilityCell> memory) {
  const auto of = [&](std::size_t cell) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(memory[cell]) << 16);
  };
  return {of(kLightNoise), of(kLobeNoise)};
}

/// Enters what a frame saw, finite and >= 0; a new frame counts 1/4.
inline void remember_light_variance(std::span<VisibilityCell> memory, const LightVariance& seen) {
  const LightVariance known = light_variance(memory);
  const auto enter = [&](std::size_t cell, float before, float now) {
    const float mean = before > 0 ? before + 0.25f * (now - before) : now;
    memory[cell] = static_cast<VisibilityCell>(std::bit_cast<std::uint32_t>(mean) >> 16);
  };
  enter(kLightNoise, known.from_light, seen.from_light);
  enter(kLobeNoise, known.from_lobes, seen.from_lobes);
}

/// What a kind of candidates needs.
struct CandidateNeed {
  float usual_noise;  ///< that M of them may leave
  float least;        ///< part of M that every pixel gets
};
inline constexpr CandidateNeed kNeedOfLight{0.0015f, 0.25f};
/// Those from lobes take more time, and few of them do not see what they miss.
inline constexpr CandidateNeed kNeedOfLobes{0.008f, 1};

/// Candidates of a kind: M where that leaves the usual noise, else in proportion to the noise
/// that M would leave, up to 64 M, in eights, at most `most`; M where nothing is known. Least
/// squared error for a given sum of candidates, as variance falls like 1 / M at least.
inline std::int32_t candidates_for_noise(std::int32_t num_candidates, float variance,
                                         const CandidateNeed& need, std::int32_t most) {
  if (!(variance > 0)) return num_candidates;
  const auto usual = static_cast<float>(num_candidates);
  const float noise = std::sqrt(variance / usual);
  const float share = std::clamp(noise / need.usual_noise, need.least, 64.0f);
  const auto wanted = static_cast<std::int32_t>(share * usual);
  return std::min((wanted + 7) / 8 * 8, std::max(most, num_candidates));
}

}  // namespace baton
