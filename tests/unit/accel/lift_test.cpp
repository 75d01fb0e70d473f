// How far shadow rays start off surfaces of other sizes and places.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/inverse.h"
#include "tests/support/chi_square.h"
#include "tests/unit/accel/spheres.h"
#include "worker/accel/accel.h"

namespace baton {
namespace {

TEST(Lift, ScalesWithTheGeometry) {
  // Small bodies, huge ones, and those where floats are coarse, whose corners are rounded: steep
  // rays alone are free there.
  const struct {
    float scale, offset;
  } cases[] = {{1e-6f, 0}, {1e-4f, 0}, {0.01f, 0}, {1e5f, 0}, {1, 1e3f}, {1, 1e4f}, {1e-3f, 10}};
  for (const auto& [scale, far] : cases) {
    const Vec3 offset{far, 0.3f * far, -far};
    const Scene scene =
        scene_of(sphere_mesh(40, 80), {{{scale, 0, 0, 0, scale, 0, 0, 0, scale}}, offset});
    const auto accel = build(scene);
    ShadowRays rays;
    float highest = 0;
    for (std::uint32_t i = 0; i < 20000; ++i) {
      const auto u = test::test_uniforms(3, 2 * i);
      const auto v = test::test_uniforms(3, 2 * i + 1);
      const Vec3 from = normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f});
      const SurfaceHit hit = trace(*accel, offset + from * (scale * 3), -from);
      // Where corners are rounded a ray may slip in between two triangles.
      if (!hit.hit || dot(hit.point.ng, hit.point.position - offset) < 0) continue;
      const float z = 0.2f + 0.8f * v[0] * v[0], r = std::sqrt(1 - z * z);
      const Vec3 wi =
          Frame(hit.point.ng).to_world({r * std::cos(6.28f * v[1]), r * std::sin(6.28f * v[1]), z});
      rays.push(hit.ray_origin, normalize(wi));
      highest = std::max(highest, length(hit.ray_origin - hit.point.position));
    }
    ASSERT_GT(rays.size(), 15000u);
    accel->occluded(rays);
    EXPECT_EQ(std::count_if(rays.t_far.begin(), rays.t_far.end(), [](float t) { return t < 0; }), 0)
        << scale << " at " << far;
    EXPECT_LT(highest, 0.002f * scale + 4e-6f * far) << scale << " at " << far;
  }
}

/// Rays off a surface that are blocked, and how far they start off it at most.
struct SelfShadow {
  std::size_t rays = 0, blocked = 0;
  float highest = 0;
};

/// Rays of at least 0.2 along the normal, off what rays from around `middle` see of one instance.
SelfShadow self_shadow(TriangleMesh mesh, const Instance& instance, const Vec3& middle) {
  mesh.normals.clear();
  Scene scene = scene_of(std::move(mesh));
  scene.instances[0] = instance;
  const auto accel = build(scene);
  ShadowRays rays;
  SelfShadow result;
  for (std::uint32_t i = 0; i < 8000; ++i) {
    const auto u = test::test_uniforms(5, 2 * i), v = test::test_uniforms(5, 2 * i + 1);
    const Vec3 from = normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f});
    const SurfaceHit hit = trace(*accel, middle + from * 3, -from);
    if (!hit.hit) continue;
    const float z = 0.2f + 0.8f * v[0] * v[0], r = std::sqrt(1 - z * z);
    const Vec3 wi =
        Frame(hit.point.ng).to_world({r * std::cos(6.28f * v[1]), r * std::sin(6.28f * v[1]), z});
    rays.push(hit.ray_origin, normalize(wi));
    result.highest =
        std::max(result.highest, dot(hit.ray_origin - hit.point.position, hit.point.ng));
  }
  accel->occluded(rays);
  result.rays = rays.size();
  const auto end = rays.t_far.begin() + static_cast<std::ptrdiff_t>(rays.size());
  result.blocked = static_cast<std::size_t>(
      std::count_if(rays.t_far.begin(), end, [](float t) { return t < 0; }));
  return result;
}

/// Turned and stretched, then put somewhere.
Instance instance_at(const Vec3& place, float turned_deg, const Vec3& scale, bool moves) {
  Instance instance;
  instance.to_world = {
      rotation_about({1, 2, 3}, turned_deg) * Mat3{{scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z}},
      place};
  instance.normal_to_world = *inverse_transposed(instance.to_world.linear);
  instance.moving_object = moves ? 0 : -1;
  return instance;
}

// Far along one axis or two the other coordinates are fine, and steps of theirs are short.
TEST(Lift, CoversTheRoundingOfAllCoordinates) {
  for (const Vec3& far :
       {Vec3{1e3f, 0, 0}, Vec3{3e3f, 0, 0}, Vec3{0, 1e4f, 0}, Vec3{0, 0, -1e4f}, Vec3{1e4f, 0, 0},
        Vec3{-7e3f, 0, 7e3f}, Vec3{0, 6e3f, 8e3f}, Vec3{3e4f, 0, 0}, Vec3{2e4f, 30, -0.2f}}) {
    for (const bool moves : {false, true}) {
      for (const Vec3& scale : {Vec3{1, 1, 1}, Vec3{0.7f, 1.6f, 0.9f}}) {
        for (const float turned : {0.0f, 40.0f}) {
          const SelfShadow found =
              self_shadow(sphere_mesh(20, 40), instance_at(far, turned, scale, moves), far);
          ASSERT_GT(found.rays, 5000u);
          EXPECT_EQ(found.blocked, 0u) << far.x << ' ' << far.y << ' ' << far.z << ' ' << moves
                                       << ' ' << turned << ' ' << scale.x;
          EXPECT_LT(found.highest, 1e-3f + 3e-6f * length(far));
        }
      }
    }
  }
}

TEST(Lift, CoversTheRoundingOfLargeTriangles) {
  // A slope of two triangles, seen in its middle.
  for (const float half : {1e3f, 1e4f, 1e5f}) {
    TriangleMesh slope;
    slope.positions = {{-half, -half / 9, -half},
                       {-half, -half / 9, half},
                       {half, half / 9, half},
                       {half, half / 9, -half}};
    slope.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const bool moves : {false, true}) {
      const Vec3 middle{0.03f, 0, 0.01f};
      const SelfShadow found = self_shadow(slope, instance_at({}, 0, {1, 1, 1}, moves), middle);
      ASSERT_GT(found.rays, 5000u);
      EXPECT_EQ(found.blocked, 0u) << half << ' ' << moves;
      EXPECT_LT(found.highest, 1e-6f * half);
    }
  }
}

TEST(Lift, IsTheUsualOneWhereFloatsAreFine) {
  const auto lift = [](const Vec3& middle, float half) {
    Bounds bounds;
    bounds.add(middle - Vec3{half, half, half});
    bounds.add(middle + Vec3{half, half, half});
    return lift_of(bounds);
  };
  for (const float half : {0.25f, 1.0f, 50.0f, 1e6f}) EXPECT_EQ(lift({}, half), Lift{}) << half;
  EXPECT_EQ(lift({20, 0, 0}, 0.5f), Lift{});
  EXPECT_LT(lift({}, 0.01f).near, Lift().near);
  EXPECT_EQ(lift({1e4f, 0, 0}, 0.5f).steps, 16);
  // Nor does a plane along an axis start higher for its place on it.
  EXPECT_EQ(lift_off({1e4f, 0, 0}, {0, 1, 0}).y, Lift().near);
  EXPECT_EQ(lift_off({1e4f, 0.5f, 0}, {0, 1, 0}), (Vec3{1e4f, 0.5f + 256 * 0x1p-24f, 0}));
}

}  // namespace
}  // namespace baton
