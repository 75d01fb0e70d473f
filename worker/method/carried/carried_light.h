#pragma once

#include <cstdint>
#include <span>

#include "common/base/limits.h"
#include "common/math/octahedral.h"
#include "common/math/padded_array.h"
#include "common/math/vec3.h"
#include "worker/light/presampled_light.h"
#include "worker/method/pixel_method.h"
#include "worker/surface/environment_view.h"

namespace baton::kernels {

/// Directions of one population that were decoded and found in the map ahead of their evaluation,
/// (N) each; the last vector is filled up with copies of the last one.
struct LocatedDirections {
  template <class T>
  using Column = PaddedArray<T, limits::kMaxParticles>;
  /// Where a direction lies in a map: the upper left texel, and how far right and down of it
  /// (bilinear maps).
  struct Place {
    Column<std::int32_t> texel;
    Column<float> right, down;
  };
  Column<float> x, y, z;  ///< unit world vectors
  Place now;
  Place before;  ///< set where has_before
  bool has_before = false;
};
/// Finds lattice directions (at most kMaxParticles) in the map of now, and where it is not null in
/// that of the frame before, and prefetches the texels there: maps are larger than the
/// caches.
void locate_directions(const EnvironmentView& now, const EnvironmentView* before,
                       std::span<const OctDirection> code, LocatedDirections& out);

/// The light of two frames for a sampler that carries.
struct CarriedLight {
  const EnvironmentView& before;
  const EnvironmentView& now;
  bool still = false;  ///< both are the same
  const PresampledLight& presampled;
  const Mat3* turn = nullptr;  ///< FrameLight::turn; `restir` alone asks
};

}  // namespace baton::kernels

namespace baton {

/// The light of the pixel's two frames.
inline kernels::CarriedLight carried_light(const PixelInput& input) {
  const FrameLight& light = input.light.frame;
  return {.before = input.light.before,
          .now = input.light.now,
          .still = light.still,
          .presampled = input.presampled,
          .turn = light.turn ? &*light.turn : nullptr};
}

}  // namespace baton
