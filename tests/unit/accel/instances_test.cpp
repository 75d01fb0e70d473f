#include <gtest/gtest.h>

#include "common/scene/mesh_loader.h"
#include "tests/support/mesh_files.h"
#include "worker/accel/accel.h"

namespace baton {
namespace {

/// Nine cubes of one mesh, some mirrored or sheared, above a square of another one.
Scene nine_cubes() {
  Scene scene;
  scene.meshes.push_back(*load_mesh(test::write_test_file("nine.off", test::kCubeOff), false));
  scene.meshes.push_back(*load_mesh(test::write_test_file("one.off", test::kSquareOff), false));
  scene.materials.emplace_back();
  for (int i = 0; i < 9; ++i) {
    const float x = 3.0f * static_cast<float>(i % 3), y = 3.0f * static_cast<float>(i / 3);
    const Mat3 linear{{i % 2 == 0 ? 1.0f : -1.0f, 0.2f, 0, 0, 1, 0, 0, 0, 0.5f}};
    scene.instances.push_back({0, 0, {linear, {x, y, 0}}, {}});
  }
  scene.instances.push_back({1, 0, {{{9, 0, 0, 0, 0, 9, 0, 1, 0}}, {0, 0, -2}}, {}});
  return scene;
}

TEST(Instances, SharedMeshesAreHitAsTheirCopiesAre) {
  const Scene scene = nine_cubes();
  const auto copied = Accel::build(scene),
             shared = Accel::build(scene, {.max_copied_triangles = 95});
  ASSERT_TRUE(copied && shared);
  int num_hits = 0;
  ShadowRays rays, same;
  for (int i = 0; i < 40 * 40; ++i) {
    const Vec3 origin{static_cast<float>(i % 40) * 0.25f - 2.03f,
                      static_cast<float>(i / 40) * 0.25f - 2.01f, 5};
    const Ray ray{origin, normalize({0.05f, 0.02f, -1})};
    SurfaceHit a, b;
    (*copied)->intersect({&ray, 1}, {&a, 1});
    (*shared)->intersect({&ray, 1}, {&b, 1});
    rays.push(origin, ray.direction);
    same.push(origin, ray.direction);
    ASSERT_EQ(a.hit, b.hit) << i;
    if (!a.hit) continue;
    ++num_hits;
    ASSERT_EQ(a.instance, b.instance) << i;
    ASSERT_NEAR(length(a.point.position - b.point.position), 0, 1e-4f) << i;
    ASSERT_NEAR(dot(a.point.ng, b.point.ng), 1, 1e-5f) << i;
  }
  EXPECT_GT(num_hits, 1000);
  (*copied)->occluded(rays);
  (*shared)->occluded(same);
  for (std::size_t i = 0; i < rays.size(); ++i)
    ASSERT_EQ(rays.t_far[i] < 0, same.t_far[i] < 0) << i;
}

}  // namespace
}  // namespace baton
