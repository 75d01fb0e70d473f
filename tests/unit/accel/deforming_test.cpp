// Meshes that have another shape in each frame.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/unit/accel/spheres.h"

namespace baton {
namespace {

using test::test_uniforms;

/// A mesh that says that it deforms; its shapes are made by the tests.
struct SaidToDeform final : Deformation {
  MeshShape at(double) const override { return {}; }
  std::array<double, 2> moving_frames() const override { return {}; }
  std::uint64_t size_bytes() const override { return 0; }
};

TEST(DeformingMeshes, HaveTheShapeOfTheirFrame) {
  Scene scene = scene_of(sphere_mesh(24, 48), {{}, {0, 1, 0}});
  scene.meshes.push_back(sphere_mesh(12, 24));
  scene.meshes[1].deformation = std::make_shared<SaidToDeform>();
  scene.instances.push_back(
      {.mesh = 1, .to_world = {{}, {1.5f, 0, 0}}, .normal_to_world = {}, .deforms = true});
  const auto rest = build(scene);
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
  const auto witness = build(still);
  int on_it = 0;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const auto u = test_uniforms(33, i);
    const Vec3 origin{6 * u[0] - 3, 6 * u[1] - 2, 5};
    const SurfaceHit hit = trace(**placed, origin, {0, 0, -1});
    const SurfaceHit expected = trace(*witness, origin, {0, 0, -1});
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
    return trace(accel, middle + outward * 0.5f, -outward);
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
