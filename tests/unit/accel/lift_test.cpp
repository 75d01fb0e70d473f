// How far shadow rays start off surfaces of other sizes and places.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
}

}  // namespace
}  // namespace baton
