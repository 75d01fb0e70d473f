#pragma once

// Scenes of one sphere, and what a ray sees of them.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "tests/support/chi_square.h"
#include "worker/accel/accel.h"

namespace baton {

/// A sphere of 2 * rings * sectors triangles, its vertices moved by `bumps` along the normal.
inline TriangleMesh sphere_mesh(int rings, int sectors, float bumps = 0) {
  TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(sectors);
      const Vec3 n{std::sin(theta) * std::cos(phi), std::cos(theta),
                   std::sin(theta) * std::sin(phi)};
      const float u = test::test_uniforms(9, static_cast<std::uint32_t>(mesh.positions.size()))[0];
      mesh.positions.push_back(n * (1 + bumps * (u - 0.5f)));
      mesh.normals.push_back(n);
    }
  }
  const auto at = [sectors](int i, int j) {
    return static_cast<std::uint32_t>(i * sectors + j % sectors);
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      if (i + 1 < rings) mesh.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return mesh;
}

/// One instance of a mesh.
inline Scene scene_of(TriangleMesh mesh, const Transform& to_world = {},
                      const Mat3& normal_to_world = {}) {
  Scene scene;
  scene.meshes.push_back(std::move(mesh));
  scene.materials.emplace_back();
  scene.instances.push_back({0, 0, to_world, normal_to_world});
  return scene;
}

inline std::unique_ptr<Accel> build(const Scene& scene) {
  auto accel = Accel::build(scene);
  EXPECT_TRUE(accel.ok());
  return std::move(*accel);
}

/// What one ray sees.
inline SurfaceHit trace(const Accel& accel, const Vec3& origin, const Vec3& direction) {
  const Ray ray{origin, normalize(direction)};
  SurfaceHit hit;
  accel.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

}  // namespace baton
