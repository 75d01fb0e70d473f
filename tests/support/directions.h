#pragma once

#include <cmath>
#include <vector>

#include "common/math/philox.h"
#include "common/math/vec3.h"

namespace baton::test {

/// Unit vectors, uniform over the sphere.
inline std::vector<Vec3> random_directions(std::size_t count, std::uint32_t seed) {
  const Rng rng({.job_seed = seed}, PassId::reference);
  std::vector<Vec3> out;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto u = rng.uniforms(0, i);
    const float z = 2 * u[0] - 1;
    const float r = std::sqrt(std::max(0.0f, 1 - z * z));
    out.push_back({r * std::cos(2 * kPi * u[1]), r * std::sin(2 * kPi * u[1]), z});
  }
  return out;
}

/// Vectors by component, as the SIMD code takes them.
struct Columns {
  std::vector<float> x, y, z;
  explicit Columns(const std::vector<Vec3>& v) {
    for (const Vec3& w : v) {
      x.push_back(w.x);
      y.push_back(w.y);
      z.push_back(w.z);
    }
  }
};

}  // namespace baton::test
