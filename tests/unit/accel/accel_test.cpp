#include "worker/accel/accel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/mesh_files.h"
#include "tests/unit/accel/spheres.h"

namespace baton {
namespace {

using test::test_uniforms;

/// Many small triangles with gaps between them: an edge decides whether a ray gets through.
TriangleMesh triangle_soup(std::uint32_t count) {
  TriangleMesh mesh;
  const auto vector = [](std::uint32_t i) {
    const auto u = test_uniforms(21, i);
    return Vec3{u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f};
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 centre = vector(4 * i) * 20.0f;
    for (std::uint32_t k = 1; k <= 3; ++k)
      mesh.positions.push_back(centre + vector(4 * i + k) * 0.6f);
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// Copy of the rays in `order`, not traced yet.
ShadowRays pick(const ShadowRays& rays, const std::vector<std::size_t>& order) {
  ShadowRays picked;
  for (const std::size_t i : order) {
    picked.push({rays.origin_x[i], rays.origin_y[i], rays.origin_z[i]},
                {rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]});
  }
  return picked;
}

/// Rays from around the soup to points on its edges and to its vertices.
ShadowRays rays_at_edges(const TriangleMesh& mesh, std::uint32_t count) {
  ShadowRays rays;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto u = test_uniforms(22, 2 * i);
    const auto v = test_uniforms(22, 2 * i + 1);
    const auto& t =
        mesh.triangles[static_cast<std::size_t>(u[3] * static_cast<float>(mesh.triangles.size()))];
    const float along = i % 2 == 0 ? 0.0f : v[0];
    const Vec3 target = mesh.positions[t[0]] * (1 - along) + mesh.positions[t[1]] * along;
    Vec3 origin = target + Vec3{u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f} * 4.0f;
    if (i % 3 == 0) origin.x = target.x;
    rays.push(origin, normalize(target - origin));
  }
  return rays;
}

TEST(Accel, HitTellsTheSurface) {
  Scene scene = scene_of(sphere_mesh(32, 64), {{{2, 0, 0, 0, 2, 0, 0, 0, 2}}, {10, 0, 0}});
  scene.instances.push_back({0, 0, {{}, {0, 20, 0}}, {}});
  const auto accel = build(scene);
  const SurfaceHit hit = trace(*accel, {10, 0.3f, 9}, {0, 0, -1});
  ASSERT_TRUE(hit.hit);
  EXPECT_EQ(hit.instance, 0u);
  EXPECT_NEAR(hit.point.position.z, std::sqrt(4 - 0.09f), 0.01f);
  EXPECT_NEAR(hit.depth, 9 - hit.point.position.z, 1e-5f);
  EXPECT_NEAR(hit.point.position.x, 10, 1e-5f);
  EXPECT_NEAR(dot(hit.point.ns, normalize(hit.point.position - Vec3{10, 0, 0})), 1, 1e-3f);
  EXPECT_GT(dot(hit.point.ng, hit.point.ns), 0.99f);
  EXPECT_EQ(hit.point.wo, (Vec3{0, 0, 1}));
  EXPECT_EQ(trace(*accel, {0, 20, 9}, {0, 0, -1}).instance, 1u);
  EXPECT_FALSE(trace(*accel, {0, 0, 9}, {0, 0, 1}).hit);
}

// Still and moving ones, which no ray meets that asks for objects.
TEST(Accel, CatchersAreApart) {
  Scene scene = scene_of(sphere_mesh(16, 32));
  scene.instances.push_back({0, 0, {{}, {0, 0, 3}}, {}, -1, true});
  scene.instances.push_back({0, 0, {{}, {5, 0, 0}}, {}, 0, true});
  const auto rest = build(scene);
  std::vector<Instance> moved = scene.instances;
  moved[2].to_world.offset = {0, 0, 6};
  const auto placed = rest->place(moved, {}).value();
  const Ray ray{{0.1f, 0.2f, 9}, {0, 0, -1}};
  SurfaceHit hit;
  for (const Accel* accel : {static_cast<const Accel*>(rest.get()), placed.get()}) {
    accel->intersect({&ray, 1}, {&hit, 1});
    EXPECT_EQ(hit.instance, 0u);
    EXPECT_FALSE(hit.is_catcher);
    accel->intersect_catchers({&ray, 1}, {&hit, 1});
    EXPECT_EQ(hit.instance, accel == rest.get() ? 1u : 2u);
    EXPECT_TRUE(hit.hit && hit.is_catcher);
    ShadowRays shadows;
    shadows.push({0, 0, 1.5f}, {0, 0, 1});
    accel->occluded(shadows);
    EXPECT_GT(shadows.t_far[0], 0);
  }
}

TEST(Accel, NormalsFaceTheViewerInsideTheMesh) {
  const Scene scene = scene_of(sphere_mesh(16, 32));
  const auto accel = build(scene);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const auto u = test_uniforms(1, i);
    const Vec3 direction = normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f});
    const SurfaceHit hit = trace(*accel, {0.1f, 0.2f, 0}, direction);
    ASSERT_TRUE(hit.hit);
    ASSERT_GE(dot(hit.point.ng, hit.point.wo), 0);
    ASSERT_GT(dot(hit.point.ns, hit.point.ng), 0);
    ASSERT_NEAR(length(hit.point.ns), 1, 1e-5f);
  }
}

TEST(Accel, MirroredAndStretchedInstancesKeepTheirNormals) {
  const Mat3 stretch{{-3, 0, 0, 0, 0.5f, 0, 0, 0, 1}};
  const Mat3 inverse{{-1.0f / 3, 0, 0, 0, 2, 0, 0, 0, 1}};
  const Scene scene = scene_of(sphere_mesh(64, 128), {stretch, {}}, inverse);
  const auto accel = build(scene);
  const SurfaceHit hit = trace(*accel, {-2, 5, 0.1f}, {0, -1, 0});
  ASSERT_TRUE(hit.hit);
  const Vec3& p = hit.point.position;
  EXPECT_NEAR(dot(hit.point.ns, normalize({p.x / 9, p.y * 4, p.z})), 1, 1e-3f);
  EXPECT_GT(dot(hit.point.ng, hit.point.ns), 0.99f);
}

TEST(Accel, MovedInstancesAreWhereAFreshSceneHasThem) {
  // A still bumpy sphere and two that move; the witness is a flat scene of all three.
  Scene scene = scene_of(sphere_mesh(24, 48, 0.2f));
  const auto add = [&](const Transform& to_world, std::int32_t moving_object) {
    scene.instances.push_back({0, 0, to_world, {}, moving_object});
  };
  add({{}, {50, 0, 0}}, 0);
  add({{}, {-50, 0, 0}}, 1);
  const auto rest = build(scene);
  std::vector<Instance> moved = scene.instances;
  moved[1].to_world = {rotation_about({1, 2, 3}, 50), {1.5f, 0.2f, 0}};
  moved[1].normal_to_world = moved[1].to_world.linear;
  moved[2].to_world = {rotation_about({0, 1, 0}, 20), {-0.4f, 2.1f, 0.3f}};
  moved[2].normal_to_world = moved[2].to_world.linear;
  const auto placed = rest->place(moved, {});
  ASSERT_TRUE(placed) << placed.error().message;

  Scene flat = scene;
  flat.instances = moved;
  for (Instance& instance : flat.instances) instance.moving_object = -1;
  const auto witness = build(flat);
  std::array<int, 3> seen{};
  ShadowRays shadow;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const auto u = test_uniforms(31, 2 * i);
    const auto v = test_uniforms(31, 2 * i + 1);
    const Vec3 origin{8 * u[0] - 4, 8 * u[1] - 4, 5};
    const Vec3 direction = normalize(Vec3{3 * v[0] - 1.5f, 4 * v[1] - 1.5f, 0} - origin);
    const SurfaceHit hit = trace(**placed, origin, direction);
    const SurfaceHit expected = trace(*witness, origin, direction);
    shadow.push(origin, direction);
    if (hit.hit != expected.hit || hit.instance != expected.instance)
      continue;  // a ray along an edge
    if (!hit.hit) continue;
    ++seen[hit.instance];
    ASSERT_NEAR(hit.depth, expected.depth, 1e-3f);
    ASSERT_GT(dot(hit.point.ns, expected.point.ns), 0.999f);
  }
  for (const int count : seen) EXPECT_GT(count, 300);

  // Shadow rays agree up to rays along edges.
  ShadowRays by_witness = shadow;
  (*placed)->occluded(shadow);
  witness->occluded(by_witness);
  int different = 0;
  for (std::size_t i = 0; i < shadow.size(); ++i)
    different += (shadow.t_far[i] < 0) != (by_witness.t_far[i] < 0) ? 1 : 0;
  EXPECT_LT(different, 8);
}

TEST(Accel, NoRayMeetsWhatIsAbsent) {
  Scene scene = scene_of(sphere_mesh(24, 48));
  scene.instances[0].moving_object = 0;
  const auto rest = build(scene);
  EXPECT_TRUE(trace(*rest, {0, 0, 5}, {0, 0, -1}).hit);
  // A disk: its hierarchy alone would be met.
  std::vector<Instance> moved = scene.instances;
  moved[0].to_world = {{{1, 0, 0, 0, 1, 0, 0, 0, 0}}, {}};
  moved[0].is_absent = true;
  const auto placed = rest->place(moved, {});
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_FALSE(trace(**placed, {0, 0, 5}, {0, 0, -1}).hit);
  ShadowRays shadow;
  shadow.push({0.1f, 0.2f, 5}, {0, 0, -1});
  (*placed)->occluded(shadow);
  EXPECT_GE(shadow.t_far[0], 0);
}

TEST(Accel, AGroupOfRaysIsTracedTheSameWhateverIsTracedWithIt) {
  const Scene scene = scene_of(triangle_soup(20000));
  const auto accel = build(scene);
  for (const std::size_t group : {1u, 4u, 9u, 16u}) {
    // Groups like the sites of a pixel, all over the soup.
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < 300 * group; ++i) {
      const auto u = test_uniforms(41, i / static_cast<std::uint32_t>(group));
      const auto v = test_uniforms(42, i);
      rays.push_back(
          {{0, 0, 30}, normalize({u[0] - 0.5f + 0.01f * v[0], u[1] - 0.5f + 0.01f * v[1], -1.5f})});
    }
    std::vector<SurfaceHit> together(rays.size());
    accel->intersect(rays, together, group);
    std::size_t hits = 0, alike = 0;
    for (std::size_t i = 0; i < rays.size(); i += group) {
      std::vector<SurfaceHit> alone(group);
      accel->intersect(std::span(rays).subspan(i, group), alone, group);
      for (std::size_t k = 0; k < group; ++k) {
        ASSERT_EQ(alone[k], together[i + k]);
        // Single rays see the same, but for the last bits.
        const SurfaceHit single = trace(*accel, rays[i + k].origin, rays[i + k].direction);
        hits += single.hit ? 1 : 0;
        alike += single.hit && together[i + k].hit &&
                         std::fabs(single.depth - together[i + k].depth) < 1e-3f
                     ? 1
                     : 0;
      }
    }
    EXPECT_GT(hits, 100u);
    EXPECT_GE(alike + 2, hits);
  }
}

TEST(Accel, LiftedRaysDoNotMeetTheirOwnSurface) {
  // A convex body: nothing above the horizon of a point can be hidden. (A small one far from the
  // origin is not convex: its corners are rounded to the floats out there.)
  for (const float scale : {0.01f, 1.0f, 30.0f}) {
    for (const Vec3& offset : {Vec3{0, 0, 0}, Vec3{0, 1, 0}, Vec3{100, -40, 7}}) {
      if (scale < 1 && offset.x > 1) continue;
      const Scene scene =
          scene_of(sphere_mesh(40, 80), {{{scale, 0, 0, 0, scale, 0, 0, 0, scale}}, offset});
      const auto accel = build(scene);
      ShadowRays rays;
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const auto u = test_uniforms(3, 2 * i);
        const auto v = test_uniforms(3, 2 * i + 1);
        const Vec3 from = normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f});
        const SurfaceHit hit = trace(*accel, offset + from * (scale * 3), -from);
        if (!hit.hit) continue;
        const float z = 0.01f + 0.99f * v[0] * v[0];  // many rays close to the horizon
        const float r = std::sqrt(1 - z * z);
        const Vec3 wi = Frame(hit.point.ng)
                            .to_world({r * std::cos(6.28f * v[1]), r * std::sin(6.28f * v[1]), z});
        rays.push(hit.ray_origin, normalize(wi));
      }
      ASSERT_GT(rays.size(), 19000u);
      accel->occluded(rays);
      EXPECT_EQ(std::count_if(rays.t_far.begin(), rays.t_far.end(), [](float t) { return t < 0; }),
                0)
          << scale << " at " << offset.x;
    }
  }
}

TEST(Accel, ThinWallStillCastsItsShadow) {
  // A roof a tenth of a millimetre above the floor, in metres.
  TriangleMesh mesh;
  for (const float y : {0.0f, 1e-4f}) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& p : {Vec3{-5, y, -5}, Vec3{-5, y, 5}, Vec3{5, y, 5}, Vec3{5, y, -5}})
      mesh.positions.push_back(p);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  const Scene scene = scene_of(mesh);
  const auto accel = build(scene);
  ShadowRays rays;
  rays.push(lift_off({1, 0, 2}, {0, 1, 0}), {0, 1, 0});
  rays.push(lift_off({1, 1e-4f, 2}, {0, 1, 0}), {0, 1, 0});
  rays.push(lift_off({1, 0, 2}, {0, -1, 0}), {0, -1, 0});
  accel->occluded(rays);
  EXPECT_EQ(rays.t_far[0], -std::numeric_limits<float>::infinity());
  EXPECT_GT(rays.t_far[1], 0);
  EXPECT_GT(rays.t_far[2], 0);
}

TEST(Accel, OcclusionAgreesWithClosestHits) {
  const Scene scene = scene_of(sphere_mesh(30, 60, 0.2f));
  const auto accel = build(scene);
  ShadowRays rays;
  std::vector<bool> expected;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const auto u = test_uniforms(5, 2 * i);
    const auto v = test_uniforms(5, 2 * i + 1);
    const Vec3 origin = Vec3{u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f} * 6.0f;
    const Vec3 direction = normalize({v[0] - 0.5f, v[1] - 0.5f, v[2] - 0.5f});
    rays.push(origin, direction);
    expected.push_back(trace(*accel, origin, direction).hit);
  }
  accel->occluded(rays);
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(rays.t_far[i] < 0, expected[i]) << i;
}

TEST(Accel, OcclusionOfARayDoesNotDependOnItsNeighbours) {
  const Scene scene = scene_of(triangle_soup(4000));
  const auto accel = build(scene);
  const ShadowRays rays = rays_at_edges(scene.meshes[0], 200000);
  std::vector<std::size_t> order(rays.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  ShadowRays together = pick(rays, order);
  accel->occluded(together);

  // The rays are on the edge: about half are blocked, and a direction one float step aside changes
  // some.
  const auto blocked =
      std::count_if(together.t_far.begin(), together.t_far.end(), [](float t) { return t < 0; });
  EXPECT_GT(blocked, 40000);
  EXPECT_LT(blocked, 160000);
  ShadowRays aside = pick(rays, order);
  for (float& x : aside.direction_x) x = std::nextafter(x, 2.0f);
  accel->occluded(aside);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    changed += (aside.t_far[i] < 0) != (together.t_far[i] < 0);
  EXPECT_GT(changed, 1000u);

  // Alone, in batches of any size, in any order: the same.
  for (const std::size_t batch : {1, 3, 8, 16, 17, 1000}) {
    const std::size_t stride = 7919;  // a prime: visits every ray once
    for (std::size_t begin = 0; begin < rays.size(); begin += batch) {
      std::vector<std::size_t> members;
      for (std::size_t k = begin; k < std::min(begin + batch, rays.size()); ++k) {
        members.push_back(batch % 2 == 0 ? k : k * stride % rays.size());
      }
      ShadowRays part = pick(rays, members);
      accel->occluded(part);
      for (std::size_t k = 0; k < members.size(); ++k) {
        ASSERT_EQ(part.t_far[k] < 0, together.t_far[members[k]] < 0)
            << "ray " << members[k] << ", batch " << batch;
      }
    }
  }
}

TEST(Accel, TwoBuildsAnswerAlike) {
  const Scene scene = scene_of(triangle_soup(4000));
  const auto first = build(scene);
  const auto second = build(scene);
  ShadowRays a = rays_at_edges(scene.meshes[0], 100000);
  ShadowRays b = a;
  first->occluded(a);
  second->occluded(b);
  EXPECT_EQ(a.t_far, b.t_far);
}

TEST(Accel, EmptyScenesAndEmptyBatches) {
  const Scene scene;
  const auto accel = build(scene);
  EXPECT_FALSE(trace(*accel, {}, {0, 0, 1}).hit);
  ShadowRays rays;
  accel->occluded(rays);
  rays.push({}, {0, 0, 1});
  accel->occluded(rays);
  EXPECT_GT(rays.t_far[0], 0);
  rays.clear();
  EXPECT_EQ(rays.size(), 0u);
}

TEST(Accel, DescriptionNamesEmbree) {
  const Scene scene;
  EXPECT_EQ(build(scene)->description().find("Embree 3."), 0u);
}

TEST(LiftOff, MovesToTheSideOfTheNormal) {
  for (const float size : {0.0f, 1e-3f, 0.03f, 1.0f, 1000.0f}) {
    for (const float sign : {-1.0f, 1.0f}) {
      const Vec3 position{size, -size, size};
      const Vec3 n = normalize({sign, sign * 0.5f, -sign});
      const float height = dot(lift_off(position, n) - position, n);
      EXPECT_GT(height, 0);
      EXPECT_LT(height, 1e-4f * std::max(size, 1.0f));
    }
  }
}

}  // namespace
}  // namespace baton
