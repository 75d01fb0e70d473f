#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include "common/math/vec3.h"

namespace baton {

/// An axis-aligned box; empty until points are added.
struct Bounds {
  static constexpr float kFar = std::numeric_limits<float>::max();

  Vec3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};

  void add(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  bool empty() const { return low.x > high.x; }
  Vec3 center() const { return (low + high) * 0.5f; }
  Vec3 size() const { return high - low; }
  /// i in [0, 8): bit 0 says which side along x, bit 1 along y, bit 2 along z.
  Vec3 corner(std::size_t i) const {
    return {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
  }
};

}  // namespace baton
