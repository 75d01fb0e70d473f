#pragma once

#include "worker/surface/environment.h"

namespace baton {

/// What the SIMD kernels need of an Environment: borrowed, plain, cheap to copy.
struct EnvironmentView {
  /// EnvironmentMap::texels(), four floats each.
  const float* texels = nullptr;
  int width = 0, height = 0, stride = 0;
  bool bilinear = true;
  /// row-major: map direction = to_map * world direction.
  std::array<float, 9> to_map{};
};

inline EnvironmentView view_of(const EnvironmentMap& map, const Mat3& rotation) {
  return {.texels = &map.texels()->r,
          .width = map.width(),
          .height = map.height(),
          .stride = map.stride(),
          .bilinear = map.filter() == MapFilter::bilinear,
          .to_map = rotation.transposed().m};
}
inline EnvironmentView view_of(const Environment& environment) {
  return view_of(*environment.map, environment.rotation);
}

}  // namespace baton
