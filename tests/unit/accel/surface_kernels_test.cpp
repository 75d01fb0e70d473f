// Surfaces at hits, beside the formulas for one of them.
#include "worker/accel/surface_kernels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/instruction_sets.h"
#include "tests/unit/accel/spheres.h"

namespace baton {
namespace {

using kernels::MetTriangles;
using test::test_uniforms;
using SurfaceKernels = OnInstructionSet;

/// What lane `k` sees, vector by vector.
SurfaceHit witness(const MetTriangles& met, std::size_t k, const Instance& instance,
                   const TriangleMesh& mesh, const Lift& lift, bool with_place) {
  const auto magnitude = [](const Vec3& v) -> Vec3 {
    return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)};
  };
  const auto& corner = mesh.triangles[met.triangle[k]];
  const float u = met.u[k], v = met.v[k];
  const auto interpolate = [u, v](const Vec3& a, const Vec3& b, const Vec3& c) {
    return a * (1 - u - v) + b * u + c * v;
  };
  const Vec3 a = instance.to_world.point(mesh.positions[corner[0]]);
  const Vec3 b = instance.to_world.point(mesh.positions[corner[1]]);
  const Vec3 c = instance.to_world.point(mesh.positions[corner[2]]);
  const Vec3 wo = -Vec3{met.direction_x[k], met.direction_y[k], met.direction_z[k]};
  Vec3 ng = normalize(cross(b - a, c - a));
  if (dot(ng, wo) < 0) ng = -ng;
  Vec3 ns = ng;
  if (!mesh.normals.empty()) {
    ns = normalize(instance.normal_to_world * interpolate(mesh.normals[corner[0]],
                                                          mesh.normals[corner[1]],
                                                          mesh.normals[corner[2]]));
    if (dot(ns, ng) < 0) ns = -ns;
    if (!(dot(ns, ng) > 0)) ns = ng;
  }
  const Vec3 position = interpolate(a, b, c);
  return {.point = {.position = position, .ng = ng, .ns = ns, .wo = wo},
          .ray_origin =
              lift_off(position, interpolate(magnitude(a), magnitude(b), magnitude(c)), ng, lift),
          .depth = met.depth[k],
          .instance = met.instance[k],
          .material = instance.material,
          .hit = true,
          .is_catcher = instance.is_catcher,
          .place = with_place ? SurfacePlace{met.triangle[k], u, v} : SurfacePlace{}};
}

/// Lanes that met one of two instances, or nothing.
MetTriangles draw(std::uint32_t number, std::size_t count, std::size_t num_triangles) {
  MetTriangles met;
  met.count = count;
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto a = test_uniforms(51, 16 * number + k), b = test_uniforms(52, 16 * number + k);
    const Vec3 direction = normalize({a[0] - 0.5f, a[1] - 0.5f, a[2] - 0.5f});
    met.direction_x[k] = direction.x;
    met.direction_y[k] = direction.y;
    met.direction_z[k] = direction.z;
    met.depth[k] = 10 * a[3];
    met.u[k] = b[0] * b[1];
    met.v[k] = b[0] * (1 - b[1]);
    met.triangle[k] = static_cast<std::uint32_t>(b[2] * static_cast<float>(num_triangles));
    met.instance[k] = b[3] < 0.4f ? 0 : b[3] < 0.8f ? 1 : MetTriangles::kNothing;
  }
  return met;
}

// Bit by bit, with lanes of another instance, or of none, left alone. Positions lie on both sides
// of where lifting changes its kind.
TEST_P(SurfaceKernels, GiveWhatTheFormulasOfOneSurfaceGive) {
  TriangleMesh mesh = sphere_mesh(12, 20, 0.3f);
  mesh.normals[30] = {};  // one that no triangle can be shaded with
  mesh.positions[mesh.triangles[5][1]] = mesh.positions[mesh.triangles[5][0]];
  for (const bool is_smooth : {true, false}) {
    if (!is_smooth) mesh.normals.clear();
    const std::vector<Instance> instances{
        {0,
         1,
         {{{0.02f, 0, 0, 0, -0.05f, 0.01f, 0, 0, 0.03f}}, {0, 0.01f, 0}},
         {{50, 0, 0, 0, -20, 0, 0, 6.7f, 33}},
         -1,
         true},
        {0, 2, {rotation_about({1, 2, 3}, 40), {7, -3, 0.5f}}, rotation_about({1, 2, 3}, 40)}};
    const MeshVertices vertices{mesh.positions, mesh.normals, {}};
    int num_hits = 0;
    for (std::uint32_t number = 0; number < 400; ++number) {
      const std::size_t count = 1 + number % kMaxRayGroup;
      const bool with_place = number % 3 == 0;
      const MetTriangles met = draw(number, count, mesh.triangles.size());
      SurfaceHit untouched;
      untouched.depth = -7;
      std::vector<SurfaceHit> hits(count, untouched), expected = hits;
      for (std::uint32_t i = 0; i < 2; ++i) {
        const auto first = std::find(met.instance.begin(), met.instance.begin() + count, i);
        const auto lane = static_cast<std::size_t>(first - met.instance.begin());
        if (lane == count) continue;
        const Lift lift{.of_rays = number % 2 == 0 ? Vec3{} : Vec3{1e-5f, 3e-4f, 2e-6f}};
        kernels::see_surfaces(met, lane, instances[i], mesh.triangles, vertices, lift, with_place,
                              hits);
        for (std::size_t k = 0; k < count; ++k) {
          if (met.instance[k] != i) continue;
          expected[k] = witness(met, k, instances[i], mesh, lift, with_place);
          ++num_hits;
        }
        ASSERT_EQ(hits, expected) << number;
      }
    }
    EXPECT_GT(num_hits, 2000);
  }
}

TEST_P(SurfaceKernels, ShadeWithTheGeometricNormalWhereTheOtherLiesInTheSurface) {
  const std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, normals(3, Vec3{1, 0, 0});
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}};
  MetTriangles met = draw(3, 5, 1);
  met.instance.fill(0);
  std::vector<SurfaceHit> hits(5);
  kernels::see_surfaces(met, 0, {}, triangles, {positions, normals, {}}, {}, false, hits);
  for (const SurfaceHit& hit : hits) {
    EXPECT_EQ(std::fabs(hit.point.ng.z), 1);
    EXPECT_EQ(hit.point.ns, hit.point.ng);
  }
}

INSTANTIATE_TEST_SUITE_P(All, SurfaceKernels, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

}  // namespace
}  // namespace baton
