#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/limits.h"
#include "common/math/vec3.h"

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
  static constexpr std::size_t kCapacity = limits::kMaxParticles;
  std::size_t count = 0;
  std::array<Vec3, kCapacity> direction;
  std::array<std::uint8_t, kCapacity> site;
  std::array<std::uint8_t, kCapacity> bin;  ///< of the pixel's memory, visibility_bin()
  std::array<Value, kCapacity> value;
  Value constant;
  /// What the even ones of all samples brought to `constant` more than the odd ones. With the
  /// values of the rays, of alternating sign, it tells two interleaved halves of the pixel apart.
  Rgb difference;

  void clear() {
    count = 0;
    constant = {};
    difference = {};
  }
  void push(const Vec3& w, std::uint8_t s, std::uint8_t b, const Value& v) {
    direction[count] = w;
    site[count] = s;
    bin[count] = b;
    value[count++] = v;
  }
};

}  // namespace baton
