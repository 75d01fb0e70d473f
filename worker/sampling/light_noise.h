#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "common/state/block_memory.h"
#include "worker/sampling/pool_tuning.h"

namespace baton {

/// How many candidates a pixel gets, by what it remembers of the noise of its light. On glossy
/// surfaces a few pixels have most of the error of an image: those that see a lamp at the rim of
/// their lobe. A number of candidates that depends on their own values would be a bias; one that
/// depends on what earlier frames saw of the pixel is not.

/// What noise is compared with: a pixel's light, as its memory expects it, and that of its
/// surroundings.
inline float noise_scale(const PoolTuning& tuning, float expected, float mean_radiance) {
  return expected + tuning.surroundings * mean_radiance;
}

/// Variance of a pixel's light, in squares of noise_scale(), that one candidate of each kind would
/// have; 0: nothing is known. Kinds are apart because they do not help each other: to a mirror that
/// sees a lamp only candidates from its lobe are of use.
struct LightVariance {
  float from_light = 0;  ///< presampled candidates of the environment
  float from_lobes = 0;  ///< candidates from glossy lobes
};

inline LightVariance light_variance(const PixelMemory& memory) {
  const auto of = [](std::uint16_t upper_half) {
    return std::bit_cast<float>(std::uint32_t{upper_half} << 16);
  };
  return {of(memory.light_noise), of(memory.lobe_noise)};
}

/// Enters what a frame saw, finite and >= 0.
inline void remember_light_variance(const PoolTuning& tuning, const LightVariance& seen,
                                    PixelMemory& memory) {
  const LightVariance known = light_variance(memory);
  const auto mean = [&](float before, float now) {
    const float sum = before > 0 ? before + tuning.new_frame * (now - before) : now;
    return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(sum) >> 16);
  };
  memory.light_noise = mean(known.from_light, seen.from_light);
  memory.lobe_noise = mean(known.from_lobes, seen.from_lobes);
}

/// Candidates of a kind: the usual number where that leaves the usual noise, else in proportion to
/// the noise that it would leave, in eights, at most `most`; the usual number where nothing is
/// known. Least squared error for a given sum of candidates, as variance falls like 1 / M at least.
inline std::int32_t candidates_for_noise(const PoolTuning& tuning,
                                         const PoolTuning::Candidates& kind,
                                         std::int32_t usual_number, float variance,
                                         std::int32_t most) {
  if (!(variance > 0)) return usual_number;
  const auto usual = static_cast<float>(usual_number);
  const float noise = std::sqrt(variance / usual);
  const float share = std::clamp(noise / kind.usual_noise, kind.least, tuning.most_candidates);
  const auto wanted = static_cast<std::int32_t>(share * usual);
  return std::min((wanted + 7) / 8 * 8, std::max(most, usual_number));
}

}  // namespace baton
