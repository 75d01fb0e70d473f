#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/limits.h"
#include "common/math/vec3.h"
#include "worker/sampling/light_noise.h"

namespace baton {

/// The shadow rays of one pixel and what each brings, in the order of the line they were chosen
/// from. The pixel is the sum of `constant` and of the values of the rays that are free, in this
/// order; its expectation must be the pixel's radiance.
struct PixelRays {
  /// Colour and share of Lns.
  struct Value {
    Rgb color;
    float visibility = 0;
  };
  /// Arrays are written in whole vectors.
  static constexpr std::size_t kCapacity = limits::kMaxParticles + 16;
  std::size_t count = 0;
  alignas(64) float x[kCapacity], y[kCapacity], z[kCapacity];  ///< unit directions
  alignas(64) float r[kCapacity], g[kCapacity], b[kCapacity];  ///< what a free ray brings
  alignas(64) float visibility[kCapacity];                     ///< and its share of Lns
  alignas(64) std::uint8_t site[kCapacity];
  alignas(64) std::uint8_t bin[kCapacity];  ///< of the pixel's memory, visibility_bin()
  Value constant;
  /// What the even ones of all samples brought to `constant` more than the odd ones. With the
  /// values of the rays, of alternating sign, it tells two interleaved halves of the pixel apart.
  float difference = 0;
  LightVariance light_variance;  ///< of this frame's candidates

  void clear() {
    count = 0;
    constant = {};
    difference = 0;
    light_variance = {};
  }
};

}  // namespace baton
