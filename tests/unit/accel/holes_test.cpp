// Surfaces with holes: sight and light pass through them, wherever the mesh is placed.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/philox.h"
#include "common/scene/pose.h"
#include "tests/support/image_files.h"
#include "worker/accel/accel.h"

namespace baton {
namespace {

/// Two squares of edge 2 in planes z = 0 and z = -1, of these materials.
Scene two_panes(const MaterialSpec& front, const MaterialSpec& back) {
  const std::string mesh =
      test::write_test_file("pane.obj",
                            "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
                            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
  JobSpec job;
  job.scene.materials = {{"front", front}, {"back", back}};
  job.scene.meshes["pane"] = {.path = mesh};
  job.scene.objects = {{.mesh = "pane", .material = "front"},
                       {.mesh = "pane", .material = "back", .translate = {0, 0, -1}}};
  Result<Scene> scene = load_scene(job);
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  return std::move(*scene);
}

/// The right half of each image is not there, but that the nearer one may be opaque.
Scene scene_with_holes(bool opaque_front) {
  MaterialSpec lace{.alpha_cutoff = 0.5f};
  lace.color_texture =
      TextureSpec{.file = test::write_targa("half.tga", 2, 1, 4, {9, 9, 9, 255, 9, 9, 9, 0}),
                  .filter = TextureFilter::nearest};
  return two_panes(opaque_front ? MaterialSpec{} : lace, lace);
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

// Of surfaces that blend, the share alpha of all rays stops; each ray by itself, at each surface
// anew, and whatever is traced beside it. Hypothesis: independent draws; seed 1; 5 sigma.
TEST(Holes, ABlendedSurfaceStopsTheShareAlphaOfTheRays) {
  constexpr std::size_t kRays = 20000;
  constexpr float kFront = 0.3f, kBack = 0.6f;
  Scene scene =
      two_panes({.alpha = kFront, .alpha_blend = true}, {.alpha = kBack, .alpha_blend = true});
  std::vector<Ray> rays;
  ShadowRays shadows;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const auto u = Rng({.job_seed = 1}, PassId::reference).uniforms(i, 0);
    const Vec3 from{u[0] - 0.5f, u[1] - 0.5f, 3};
    const Vec3 to{u[2] - 0.5f, u[3] - 0.5f, -1};
    rays.push_back({from, normalize(to - from)});
    shadows.push(from, rays.back().direction);
  }
  for (const bool moves : {false, true}) {
    for (std::size_t i = 0; moves && i < scene.instances.size(); ++i)
      scene.instances[i].moving_object = static_cast<std::int32_t>(i);
    for (const std::uint64_t most_copied : {std::uint64_t{0}, limits::kMaxCopiedTriangles}) {
      const auto accel = Accel::build(scene, {.max_copied_triangles = most_copied});
      ASSERT_TRUE(accel.ok());
      std::vector<SurfaceHit> hits(kRays), grouped(kRays);
      (*accel)->intersect(rays, hits);
      (*accel)->intersect(rays, grouped, 16);
      EXPECT_EQ(hits, grouped);

      std::array<double, 3> seen{};  // front, back, none
      for (const SurfaceHit& hit : hits) seen.at(hit.hit ? hit.instance : 2) += 1.0 / kRays;
      const auto expect_share = [&](double share, double expected) {
        EXPECT_NEAR(share, expected, 5 * std::sqrt(expected * (1 - expected) / kRays));
      };
      expect_share(seen[0], kFront);
      expect_share(seen[1], (1 - kFront) * kBack);
      expect_share(seen[2], (1 - kFront) * (1 - kBack));

      // A shadow ray fares as the ray of sight along its way, in a stream or alone.
      ShadowRays all = shadows;
      (*accel)->occluded(all);
      for (std::size_t i = 0; i < kRays; ++i) ASSERT_EQ(all.t_far[i] < 0, hits[i].hit);
      for (std::size_t i = 0; i < 300; ++i) {
        ShadowRays one;
        one.push(rays[i].origin, rays[i].direction);
        (*accel)->occluded(one);
        EXPECT_EQ(one.t_far[0], all.t_far[i]);
      }
    }
  }
}

}  // namespace
}  // namespace baton
