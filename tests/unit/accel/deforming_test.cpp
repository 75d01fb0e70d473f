// Meshes that have another shape in each frame.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/chi_square.h"
#include "worker/accel/accel.h"

namespace baton {
namespace {

using test::test_uniforms;

/// A sphere of radius 1.
TriangleMesh ball_mesh(int rings, int sectors) {
  TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(sectors);
      const Vec3 n{std::sin(theta) * std::cos(phi), std::cos(theta),
                   std::sin(theta) * std::sin(phi)};
      mesh.positions.push_back(n);
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

Scene scene_with(TriangleMesh mesh, const Transform& to_world) {
  Scene scene;
  scene.meshes.push_back(std::move(mesh));
  scene.materials.emplace_back();
  scene.instances.push_back({0, 0, to_world, {}});
  return scene;
}

std::unique_ptr<Accel> build_tracer(const Scene& scene) {
  auto accel = Accel::build(scene);
  EXPECT_TRUE(accel.ok());
  return std::move(*accel);
}

SurfaceHit first_hit(const Accel& accel, const Vec3& origin, const Vec3& direction) {
  const Ray ray{origin, normalize(direction)};
  SurfaceHit hit;
  accel.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

/// A mesh that says that it deforms; its shapes are made by the tests.
struct SaidToDeform final : Deformation {
  MeshShape at(double) const override { return {}; }
  std::uint64_t size_bytes() const override { return 0; }
};

TEST(DeformingMeshes, HaveTheShapeOfTheirFrame) {
  Scene scene = scene_with(ball_mesh(24, 48), {{}, {0, 1, 0}});
  scene.meshes.push_back(ball_mesh(12, 24));
  scene.meshes[1].deformation = std::make_shared<SaidToDeform>();
  scene.instances.push_back(
      {.mesh = 1, .to_world = {{}, {1.5f, 0, 0}}, .normal_to_world = {}, .deforms = true});
  const auto rest = build_tracer(scene);
  EXPECT_GT(rest->placement_bytes(), 100 * scene.meshes[1].triangles.size() / 4);

  // Another one, of which the upper half is drawn out, and two triangles are collapsed.
  auto shape = std::make_shared<MeshShape>(
      MeshShape{scene.meshes[1].positions, scene.meshes[1].normals, {}});
  for (Vec3& p : shape->positions) p.y *= p.y > 0 ? 2.5f : 1.0f;
  const std::size_t gone = 300;
  const auto lost = scene.meshes[1].triangles[gone];
  const MeshShapes shapes{nullptr, shape};
  const auto placed = rest->place(scene.instances, shapes);
  ASSERT_TRUE(placed) << placed.error().message;
  Scene still = scene;
  still.meshes[1] = {.positions = shape->positions,
                     .normals = shape->normals,
                     .triangles = scene.meshes[1].triangles};
  still.instances[1].deforms = false;
  const auto witness = build_tracer(still);
  int on_it = 0;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const auto u = test_uniforms(33, i);
    const Vec3 origin{6 * u[0] - 3, 6 * u[1] - 2, 5};
    const SurfaceHit hit = first_hit(**placed, origin, {0, 0, -1});
    const SurfaceHit expected = first_hit(*witness, origin, {0, 0, -1});
    if (hit.hit != expected.hit || hit.instance != expected.instance) continue;  // an edge
    EXPECT_EQ(hit.point, expected.point);
    EXPECT_EQ(hit.place == SurfacePlace{}, hit.instance != 1);
    on_it += hit.instance == 1 ? 1 : 0;
  }
  EXPECT_GT(on_it, 300);

  // A triangle without area in a frame is not there in it; the one at rest is as it was.
  const Vec3 middle = (scene.meshes[1].positions[lost[0]] + scene.meshes[1].positions[lost[1]] +
                       scene.meshes[1].positions[lost[2]]) /
                          3 +
                      Vec3{1.5f, 0, 0};
  const Vec3 outward = normalize(middle - Vec3{1.5f, 0, 0});
  const auto seen = [&](const Accel& accel) {
    return first_hit(accel, middle + outward * 0.5f, -outward);
  };
  ASSERT_TRUE(seen(*rest).hit);
  EXPECT_EQ(seen(*rest).place.triangle, gone);
  auto collapsed = std::make_shared<MeshShape>(
      MeshShape{scene.meshes[1].positions, scene.meshes[1].normals, {}});
  collapsed->positions[lost[1]] = collapsed->positions[lost[0]];
  const MeshShapes torn{nullptr, collapsed};
  const auto without = rest->place(scene.instances, torn);
  ASSERT_TRUE(without) << without.error().message;
  const SurfaceHit behind = seen(**without);
  EXPECT_TRUE(!behind.hit || behind.place.triangle != gone);
}

}  // namespace
}  // namespace baton
