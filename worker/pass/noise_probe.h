#pragma once

#include <cstdint>

#include "worker/pass/aside.h"

namespace baton {

/// One pixel of so many is a probe: the cost of telling the noise.
inline constexpr std::uint32_t kProbeSpacing = 128;

/// Whether a pixel is one. Probes lie on a lattice with about equal distances of 12 pixels. It
/// moves with frame and seed: 128 frames, or seeds, probe every pixel once.
constexpr bool is_probe(std::int32_t x, std::int32_t y, FrameNumber frame, std::uint64_t job_seed) {
  constexpr std::uint32_t kRowShift = 12, kFrameShift = 79, kSeedShift = 37;
  const std::uint32_t place = static_cast<std::uint32_t>(x) +
                              kRowShift * static_cast<std::uint32_t>(y) +
                              kFrameShift * static_cast<std::uint32_t>(frame.value()) +
                              kSeedShift * static_cast<std::uint32_t>(job_seed);
  return place % kProbeSpacing == 0;
}

/// The address of the numbers that a pixel is drawn with a second time.
constexpr RngKey probe_key(RngKey key) {
  key.round = static_cast<std::uint32_t>(kProbeRound.value()) - key.round;
  return key;
}

/// Samples pixels a second time: the same sites, what the pixel remembers, and the same method, but
/// random numbers and presampled light of their own (kProbeRound). Both estimates are independent
/// given the past and agree in the mean, so half the square of their difference is the variance of
/// the pixel, without bias and however a method stratifies. Nothing of it enters the image. For
/// methods that carry no samples (tells_noise): another draw from carried ones would be as wrong as
/// the first.
class NoiseProbe {
 public:
  /// The radiance of a pixel, once more. input: what the method is about to be given. light:
  /// of kProbeRound, on the maps of the pixel's round; presampled: what the pixel reads of it.
  Rgb sample_again(const PixelMethod& method, const PixelInput& input, const RoundLight& light,
                   const PresampledLight& presampled, const PixelState& pixel,
                   const SiteOrigins& origins);

 private:
  AsideSampler aside_;
};

}  // namespace baton
