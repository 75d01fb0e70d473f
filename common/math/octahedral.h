#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/math/vec3.h"

namespace baton {

/// A unit direction on the octahedral lattice of 2 x 16 bits [Meyer et al. 2010; Cigolle et al.
/// 2014]: x in the low half. Every carried direction lies on this lattice, in memory as in the
/// file, so a resume is exact. Neighbours along one axis are at most 0.0044 degrees apart; encoding
/// moves a direction by at most 0.0038 degrees. encode(decode(code)) is code, save on the rim (a
/// half 0 or 65535), where two codes (all four at the corners) mean one direction: there it is one
/// of them, always the same.
using OctDirection = std::uint32_t;
/// The most by which encoding moves a direction, radians.
inline constexpr double kOctahedralError = 6.7e-5;

inline OctDirection encode_octahedral(const Vec3& w) {
  const float inv = 1.0f / (std::fabs(w.x) + std::fabs(w.y) + std::fabs(w.z));
  float u = w.x * inv;
  float v = w.y * inv;
  if (w.z < 0) {
    const float fold_u = std::copysign(1.0f - std::fabs(v), u);
    const float fold_v = std::copysign(1.0f - std::fabs(u), v);
    u = fold_u;
    v = fold_v;
  }
  const auto pack = [](float t) {
    const float scaled = (t * 0.5f + 0.5f) * 65535.0f + 0.5f;
    return static_cast<std::uint32_t>(std::clamp(scaled, 0.0f, 65535.0f));
  };
  return pack(u) | (pack(v) << 16);
}

inline Vec3 decode_octahedral(OctDirection code) {
  const float u = static_cast<float>(code & 0xFFFFu) * (2.0f / 65535.0f) - 1.0f;
  const float v = static_cast<float>(code >> 16) * (2.0f / 65535.0f) - 1.0f;
  const float z = 1.0f - std::fabs(u) - std::fabs(v);
  const float fold = std::max(-z, 0.0f);
  const Vec3 w{u - std::copysign(fold, u), v - std::copysign(fold, v), z};
  return w / length(w);
}

}  // namespace baton
