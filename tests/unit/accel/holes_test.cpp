// Surfaces with holes: sight and light pass through them, wherever the mesh is placed.
#include <gtest/gtest.h>

#include "tests/support/image_files.h"
#include "worker/accel/accel.h"
#include "worker/scene/pose.h"

namespace baton {
namespace {

/// Two squares of edge 2 in planes z = 0 and z = -1; the right half of each image is not there. The
/// nearer one is opaque where `front` says so.
Scene scene_with_holes(bool opaque_front) {
  const std::string mesh =
      test::write_test_file("pane.obj",
                            "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
                            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
  MaterialSpec lace{.alpha_cutoff = 0.5f};
  lace.color_texture =
      TextureSpec{.file = test::write_targa("half.tga", 2, 1, 4, {9, 9, 9, 255, 9, 9, 9, 0}),
                  .filter = TextureFilter::nearest};
  JobSpec job;
  job.scene.materials = {{"lace", lace}, {"solid", {}}};
  job.scene.meshes["pane"] = {.path = mesh};
  job.scene.objects = {{.mesh = "pane", .material = opaque_front ? "solid" : "lace"},
                       {.mesh = "pane", .material = "lace", .translate = {0, 0, -1}}};
  Result<Scene> scene = load_scene(job);
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  return std::move(*scene);
}

void expect_holes(const Accel& accel, bool opaque_front) {
  const std::vector<Ray> rays{{{-0.5f, 0.1f, 3}, {0, 0, -1}}, {{0.5f, 0.1f, 3}, {0, 0, -1}}};
  std::vector<SurfaceHit> hits(2);
  for (const std::size_t group : {1u, 2u}) {
    accel.intersect(rays, hits, group);
    ASSERT_TRUE(hits[0].hit);
    EXPECT_EQ(hits[0].instance, 0u);
    EXPECT_EQ(hits[1].hit, opaque_front);
  }
  // Towards the panes from behind.
  ShadowRays shadows;
  shadows.push({-0.5f, 0.1f, -3}, {0, 0, 1});
  shadows.push({0.5f, 0.1f, -3}, {0, 0, 1});
  shadows.push({0.5f, 0.1f, -0.5f}, {0, 0, -1});
  accel.occluded(shadows);
  EXPECT_LT(shadows.t_far[0], 0);
  EXPECT_EQ(shadows.t_far[1] < 0, opaque_front);
  EXPECT_GT(shadows.t_far[2], 0);
}

TEST(Holes, SightAndLightPass) {
  for (const bool opaque_front : {false, true}) {
    const Scene scene = scene_with_holes(opaque_front);
    const auto copied = Accel::build(scene);
    ASSERT_TRUE(copied.ok());
    expect_holes(**copied, opaque_front);
    // Both from one mesh that is not copied.
    const auto placed = Accel::build(scene, {.max_copied_triangles = 0});
    ASSERT_TRUE(placed.ok());
    expect_holes(**placed, opaque_front);
  }
}

TEST(Holes, MovingPanesHaveThem) {
  Scene scene = scene_with_holes(false);
  for (std::size_t i = 0; i < scene.instances.size(); ++i)
    scene.instances[i].moving_object = static_cast<std::int32_t>(i);
  const auto accel = Accel::build(scene);
  ASSERT_TRUE(accel.ok());
  expect_holes(**accel, false);
}

}  // namespace
}  // namespace baton
