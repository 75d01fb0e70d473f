#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/limits.h"
#include "common/math/padded_array.h"
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
  template <class T>
  using Column = PaddedArray<T, limits::kMaxParticles>;
  std::size_t count = 0;
  Column<float> x, y, z;     ///< unit directions
  Column<float> r, g, b;     ///< what a free ray brings
  Column<float> visibility;  ///< share of Lns of a free ray
  Column<std::uint8_t> site;
  Column<std::uint16_t> tag;  ///< RayTag, where rays are remembered
  Value constant;
  LightVariance light_variance;  ///< variance of this frame's candidates

  void clear() {
    count = 0;
    constant = {};
    light_variance = {};
  }
};

}  // namespace baton
