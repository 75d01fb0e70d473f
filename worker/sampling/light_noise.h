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

/// Variance of a pixel's light, in squares of noise_scale(), that one candidate would have; 0:
/// nothing is known. The memory's last cell holds the upper half of the float.
inline float light_variance(std::span<const VisibilityCell> memory) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(memory[kLightNoise]) << 16);
}

/// Enters what a frame saw, finite and >= 0; a new frame counts 1/4.
inline void remember_light_variance(std::span<VisibilityCell> memory, float variance) {
  const float before = light_variance(memory);
  const float mean = before > 0 ? before + 0.25f * (variance - before) : variance;
  memory[kLightNoise] = static_cast<VisibilityCell>(std::bit_cast<std::uint32_t>(mean) >> 16);
}

/// Candidates of a pixel: M where that leaves a noise of 0.3 %, else in proportion to the noise
/// that M would leave, from M / 2 to 64 M, in eights, at most `most`; M where nothing is known.
/// Least squared error for a given sum of candidates, as variance falls like 1 / M at least.
inline constexpr float kUsualNoise = 0.003f;
inline std::int32_t candidates_for_noise(std::int32_t num_candidates, float variance,
                                         std::int32_t most) {
  if (!(variance > 0)) return num_candidates;
  const auto usual = static_cast<float>(num_candidates);
  const float share = std::clamp(std::sqrt(variance / usual) / kUsualNoise, 0.5f, 64.0f);
  const auto wanted = static_cast<std::int32_t>(share * usual);
  return std::min((wanted + 7) / 8 * 8, std::max(most, num_candidates));
}

}  // namespace baton
