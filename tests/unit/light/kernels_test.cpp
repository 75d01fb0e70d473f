// The SIMD kernels against their scalar witnesses, on every instruction set of this machine.
#include "worker/light/candidates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/directions.h"
#include "tests/support/instruction_sets.h"
#include "worker/surface/bsdf.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

using test::Columns;
using test::random_directions;

Material material_of(MaterialKind kind) {
  MaterialSpec spec;
  spec.kind = kind;
  spec.base_color = {0.8f, 0.5f, 0.3f};
  spec.roughness = 0.3f;
  spec.metallic = 0.5f;
  spec.specular = 0.4f;
  return make_material(spec);
}

ShadingPoint tilted_point(const Vec3& ns, const Vec3& wo) {
  return {.position = {0, 0, 0}, .ng = normalize(ns + Vec3{0.1f, 0.05f, 0}), .ns = ns, .wo = wo};
}

class Kernels : public OnInstructionSet {};
INSTANTIATE_TEST_SUITE_P(Sets, Kernels, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

TEST_P(Kernels, RunOnTheChosenSet) {
  EXPECT_EQ(kernels::instruction_set(), hwy::TargetName(GetParam()));
}

TEST_P(Kernels, DecodeAsTheScalarCode) {
  std::vector<OctDirection> codes;
  for (std::uint32_t i = 0; i < 10001; ++i) codes.push_back(i * 2654435761u);
  std::vector<float> x(codes.size()), y(codes.size()), z(codes.size());
  kernels::decode_directions(codes, x, y, z);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const Vec3 w = decode_octahedral(codes[i]);
    ASSERT_LT(length(w - Vec3{x[i], y[i], z[i]}), 4e-7f) << codes[i];
  }
}

TEST_P(Kernels, EnvironmentAsTheScalarCode) {
  RgbImage image{16, 8, {}};
  for (int i = 0; i < 16 * 8 * 3; ++i) image.rgb.push_back(static_cast<float>((i * 37) % 23));
  std::vector<Vec3> directions = random_directions(5000, 3);
  for (const Vec3& axis :
       {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
    directions.push_back(axis);
  }
  const Columns w(directions);
  for (const MapFilter filter : {MapFilter::nearest, MapFilter::bilinear}) {
    const HiddenCone below{.axis = {0, -1, 0}, .angle = 1.2f};
    const Environment environment{
        std::make_shared<EnvironmentMap>(image, filter, 1.0f, false, below),
        rotation_about({0.2f, 1, 0.1f}, 33)};
    std::vector<float> r(w.x.size()), g(r), b(r), density(r);
    kernels::evaluate_environment(view_of(environment), w.x, w.y, w.z, r, g, b, density);
    std::vector<float> seen_r(r), seen_g(r), seen_b(r);
    kernels::see_environment(view_of(environment), w.x, w.y, w.z, seen_r, seen_g, seen_b);
    int on_edge = 0, hidden = 0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const EnvironmentMap::Texel t = environment.evaluate(directions[i]);
      const float lights = t.is_hidden() ? 0.0f : 1.0f;
      hidden += t.is_hidden() ? 1 : 0;
      // A direction within float error of a cell's edge may fall on either side.
      const bool equal = std::fabs(lights * t.r - r[i]) < 1e-3f &&
                         std::fabs(lights * t.b - b[i]) < 1e-3f &&
                         std::fabs(t.r - seen_r[i]) < 1e-3f && std::fabs(t.b - seen_b[i]) < 1e-3f &&
                         std::fabs(t.density - density[i]) < 1e-4f * (1 + t.density);
      on_edge += equal ? 0 : 1;
    }
    EXPECT_LE(on_edge, 7);  // the poles and the seam, exactly on edges after rotation
    EXPECT_GT(hidden, 500);
  }
}

TEST_P(Kernels, BsdfAsTheScalarCode) {
  const std::vector<Vec3> directions = random_directions(4000, 5);
  const Columns w(directions);
  const std::vector<Material> materials{
      material_of(MaterialKind::diffuse), material_of(MaterialKind::phong),
      material_of(MaterialKind::metallic_roughness),
      make_material({.kind = MaterialKind::metallic_roughness, .roughness = 0.4f, .specular = 0})};
  for (const Vec3& wo : {normalize(Vec3{0.3f, 0.9f, 0.2f}), normalize(Vec3{1, 0.02f, 0})}) {
    // All materials in one pixel, and sites in mixed order within a vector.
    SiteBlock sites;
    sites.clear(4);
    for (int s = 0; s < 4; ++s)
      sites.add(s, tilted_point({0, 1, 0}, wo), materials[static_cast<std::size_t>(s)]);
    std::vector<std::int32_t> site;
    for (std::size_t i = 0; i < directions.size(); ++i)
      site.push_back(static_cast<std::int32_t>(i % 4));
    std::vector<float> r(w.x.size()), g(r), b(r), pdf(r);
    kernels::evaluate_bsdf(sites, site, w.x, w.y, w.z, r, g, b, pdf);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const Material& material = materials[i % 4];
      const ShadingPoint point = tilted_point({0, 1, 0}, wo);
      const Rgb f = evaluate_bsdf(material, point, directions[i]) * std::max(0.0f, directions[i].y);
      const float tolerance = 1e-5f + 2e-3f * f.x;
      ASSERT_NEAR(r[i], f.x, tolerance) << "material " << i % 4 << " direction " << i;
      ASSERT_NEAR(b[i], f.z, tolerance);
      const float expected_pdf = bsdf_pdf_solid_angle(material, point, directions[i]);
      ASSERT_NEAR(pdf[i], expected_pdf, 1e-5f + 2e-3f * expected_pdf)
          << "material " << i % 4 << " direction " << i;
    }
  }
}

TEST_P(Kernels, ManySitesAreLookedUpRight) {
  // 16 sites with different albedos: each lane must get its own.
  SiteBlock sites;
  sites.clear(16);
  for (int s = 0; s < 16; ++s) {
    Material m = material_of(MaterialKind::diffuse);
    m.kd = Rgb{1, 1, 1} * (static_cast<float>(s) / 16);
    sites.add(s, tilted_point({0, 1, 0}, {0, 1, 0}), m);
  }
  std::vector<std::int32_t> site;
  for (int i = 0; i < 64; ++i) site.push_back((i * 7) % 16);
  const std::vector<float> x(64, 0.0f), y(64, 1.0f), z(64, 0.0f);
  std::vector<float> r(64), g(64), b(64), pdf(64);
  kernels::evaluate_bsdf(sites, site, x, y, z, r, g, b, pdf);
  for (std::size_t i = 0; i < 64; ++i)
    EXPECT_NEAR(r[i], kInvPi * static_cast<float>(site[i]) / 16, 1e-6f);
}

TEST_P(Kernels, SampledDirectionsAreUnitAndFinite) {
  const Rng rng({.job_seed = 9}, PassId::reference);
  std::vector<float> u0, u1;
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const auto u = rng.uniforms(0, i);
    u0.push_back(u[0]);
    u1.push_back(u[1]);
  }
  u0[0] = 0;
  u1[0] = 0;
  u0[1] = 0x1.fffffep-1f;
  for (const MaterialKind kind :
       {MaterialKind::diffuse, MaterialKind::phong, MaterialKind::metallic_roughness}) {
    for (const Vec3& wo :
         {Vec3{0, 1, 0}, normalize(Vec3{1, 1e-4f, 0}), normalize(Vec3{1, -1e-4f, 0})}) {
      SiteBlock sites;
      sites.clear(1);
      sites.add(0, tilted_point({0, 1, 0}, wo), material_of(kind));
      const std::vector<std::int32_t> site(u0.size(), 0);
      std::vector<float> x(u0.size()), y(x), z(x);
      kernels::sample_bsdf(sites, site, u0, u1, x, y, z);
      for (std::size_t i = 0; i < x.size(); ++i) {
        ASSERT_NEAR(x[i] * x[i] + y[i] * y[i] + z[i] * z[i], 1.0f, 1e-4f) << i;
      }
    }
  }
}

}  // namespace
}  // namespace baton
