// Clear coats in SIMD against the scalar code, beside other materials in one pixel, on every
// instruction set of this machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/directions.h"
#include "tests/support/instruction_sets.h"
#include "worker/light/candidates.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

using test::Columns;

Material coated(float metallic, float clearcoat, float coat_roughness) {
  return make_material({.kind = MaterialKind::metallic_roughness,
                        .base_color = {0.8f, 0.5f, 0.3f},
                        .metallic = metallic,
                        .roughness = 0.3f,
                        .clearcoat = clearcoat,
                        .clearcoat_roughness = coat_roughness});
}

Material with_normal(Material material, const Vec3& normal) {
  material.coat.normal = normal;
  return material;
}

/// Coats with the surface's normal and with one of their own, and what has none.
std::array<Material, 5> materials_of_pixel() {
  return {coated(0, 1, 0.1f), with_normal(coated(0.5f, 0.6f, 0.4f), normalize({0.3f, 1, 0.1f})),
          coated(0, 0, 0.2f),
          make_material({.kind = MaterialKind::phong, .kd = 0.4f, .ks = 0.5f, .exponent = 60}),
          make_material({})};
}

ShadingPoint tilted_point(const Vec3& wo) {
  const Vec3 ns{0, 1, 0};
  return {.position = {}, .ng = normalize(ns + Vec3{0.1f, 0.05f, 0}), .ns = ns, .wo = wo};
}

/// Directions over the upper half space and a little below.
std::vector<Vec3> upper_directions(std::size_t count) {
  std::vector<Vec3> out = test::random_directions(count, 5);
  for (Vec3& w : out) w = normalize({w.x, std::fabs(w.z) - 0.1f, w.y});
  return out;
}

class CoatKernels : public OnInstructionSet {};
INSTANTIATE_TEST_SUITE_P(Sets, CoatKernels, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

// Copies in another order, of which each comes from a block of its own or from a common one.
TEST_P(CoatKernels, ACopyOfASiteIsTheSite) {
  const auto materials = materials_of_pixel();
  const ShadingPoint point = tilted_point(normalize(Vec3{0.3f, 0.9f, 0.2f}));
  SiteBlock sites, copies;
  sites.clear(5);
  copies.clear(5);
  for (int s = 0; s < 5; ++s) sites.add(s, point, materials[static_cast<std::size_t>(s)]);
  for (int s = 0; s < 5; ++s) {
    SiteBlock alone;
    alone.clear(1);
    alone.add(0, point, materials[static_cast<std::size_t>(4 - s)]);
    if (s < 2)
      copies.add_copy(s, alone, 0);
    else
      copies.add_copy(s, sites, 4 - s);
  }
  EXPECT_EQ(copies.num_hits, 5);
  EXPECT_EQ(copies.num_lobes, sites.num_lobes);
  EXPECT_FLOAT_EQ(copies.specular_sum, sites.specular_sum);
  const Columns w(upper_directions(203));
  for (int s = 0; s < 5; ++s) {
    const std::vector<std::int32_t> of_copy(w.x.size(), s), of_site(w.x.size(), 4 - s);
    std::vector<float> r(w.x.size()), g(r), b(r), pdf(r), r2(r), g2(r), b2(r), pdf2(r);
    kernels::evaluate_bsdf(copies, of_copy, w.x, w.y, w.z, r, g, b, pdf);
    kernels::evaluate_bsdf(sites, of_site, w.x, w.y, w.z, r2, g2, b2, pdf2);
    EXPECT_EQ(r, r2) << s;
    EXPECT_EQ(g, g2) << s;
    EXPECT_EQ(b, b2) << s;
    EXPECT_EQ(pdf, pdf2) << s;
  }
}

TEST_P(CoatKernels, MixedSitesAsTheScalarCode) {
  const auto materials = materials_of_pixel();
  const Columns w(upper_directions(4003));
  for (const Vec3& wo : {normalize(Vec3{0.3f, 0.9f, 0.2f}), normalize(Vec3{1, 0.02f, 0}),
                         normalize(Vec3{1, -0.01f, 0})}) {
    const ShadingPoint point = tilted_point(wo);
    for (const std::size_t stretch : {1u, 8u}) {  // mixed and whole vectors
      SiteBlock sites;
      sites.clear(5);
      for (int s = 0; s < 5; ++s) sites.add(s, point, materials[static_cast<std::size_t>(s)]);
      std::vector<std::int32_t> site;
      for (std::size_t i = 0; i < w.x.size(); ++i)
        site.push_back(static_cast<std::int32_t>(i / stretch % 5));
      std::vector<float> r(w.x.size()), g(r), b(r), pdf(r);
      kernels::evaluate_bsdf(sites, site, w.x, w.y, w.z, r, g, b, pdf);
      for (std::size_t i = 0; i < site.size(); ++i) {
        const Vec3 wi{w.x[i], w.y[i], w.z[i]};
        const Material& m = materials[static_cast<std::size_t>(site[i])];
        const Rgb f = evaluate_bsdf(m, point, wi) * std::max(wi.y, 0.0f) +
                      Rgb{1, 1, 1} * evaluate_coat(m, point, wi);
        ASSERT_NEAR(r[i], f.x, 1e-4f + 3e-3f * f.x) << "site " << site[i] << " direction " << i;
        ASSERT_NEAR(b[i], f.z, 1e-4f + 3e-3f * f.z) << "site " << site[i] << " direction " << i;
        const float density = bsdf_pdf_solid_angle(m, point, wi);
        ASSERT_NEAR(pdf[i], density, 1e-4f + 3e-3f * density)
            << "site " << site[i] << " direction " << i;
      }
    }
  }
}

// A lane's value does not depend on what the other lanes see.
TEST_P(CoatKernels, OthersAreTheSameBitsBesideACoat) {
  const auto materials = materials_of_pixel();
  const Columns w(upper_directions(1000));
  const ShadingPoint point = tilted_point(normalize({0.3f, 0.9f, 0.2f}));
  std::array<std::array<std::vector<float>, 4>, 2> found;
  for (const bool beside : {false, true}) {
    SiteBlock sites;
    sites.clear(2);
    sites.add(0, point, materials[2]);
    sites.add(1, point, materials[beside ? 0 : 2]);
    std::vector<std::int32_t> site;
    for (std::size_t i = 0; i < w.x.size(); ++i) site.push_back(static_cast<std::int32_t>(i % 2));
    auto& out = found[beside ? 1 : 0];
    for (auto& column : out) column.resize(w.x.size());
    kernels::evaluate_bsdf(sites, site, w.x, w.y, w.z, out[0], out[1], out[2], out[3]);
  }
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t i = 0; i < w.x.size(); i += 2) ASSERT_EQ(found[0][c][i], found[1][c][i]) << i;
  }
}

// A block is used again, after other pixels.
TEST_P(CoatKernels, NoCoatStaysBehind) {
  const ShadingPoint point = tilted_point(normalize({0.3f, 0.9f, 0.2f}));
  SiteBlock sites;
  sites.clear(2);
  for (int s = 0; s < 2; ++s) sites.add(s, point, coated(0, 1, 0.1f));
  sites.clear(2);
  sites.add(0, point, coated(0, 0, 0.1f));
  EXPECT_FALSE(sites.any_coat);
  sites.add(1, point, coated(0, 1, 0.1f));
  EXPECT_TRUE(sites.any_coat);
  EXPECT_EQ(sites.coats.share[0], 0);
  EXPECT_EQ(sites.coats.chance[0], 0);
  EXPECT_GT(sites.coats.share[1], 0);
  EXPECT_GT(sites.coats.chance[1], 0);
}

TEST_P(CoatKernels, SamplesFollowTheirDensity) {
  constexpr std::uint32_t kCount = 100000;
  const auto materials = materials_of_pixel();
  std::vector<float> u0, u1;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const auto u = test::test_uniforms(3, i);
    u0.push_back(u[0]);
    u1.push_back(u[1]);
  }
  const std::vector<std::int32_t> site(kCount, 0);
  for (std::size_t k = 0; k < 2; ++k) {
    for (const Vec3& wo : {normalize(Vec3{0.3f, 0.9f, 0.2f}), normalize(Vec3{1, 0.1f, 0})}) {
      const ShadingPoint point = tilted_point(wo);
      SiteBlock sites;
      sites.clear(1);
      sites.add(0, point, materials[k]);
      std::vector<float> x(kCount), y(x), z(x);
      kernels::sample_bsdf(sites, site, u0, u1, x, y, z);
      std::uint32_t next = 0;
      const test::ChiSquareResult result = test::chi_square_sphere(
          [&](const std::array<float, 4>&) {
            const std::uint32_t i = next++;
            return Vec3{x[i], y[i], z[i]};
          },
          [&](const Vec3& wi) { return bsdf_pdf_solid_angle(materials[k], point, wi); },
          {.axis = reflect(wo, see_coat(materials[k], point).point.ns),
           .num_rings = 32,
           .num_sectors = 32,
           .power = 3},
          kCount);
      EXPECT_GT(result.p_value, test::sidak_level(0.001, 4)) << k;
    }
  }
}

}  // namespace
}  // namespace baton
