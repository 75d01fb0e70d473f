// Clear coats: density, energy, what is below, the formula of KHR_materials_clearcoat.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/chi_square.h"
#include "worker/surface/bsdf.h"

namespace baton {
namespace {

constexpr std::uint32_t kNumSamples = 200000;
/// Chance that a whole run of a test in this file raises a false alarm.
constexpr double kLevel = 0.01;

struct Below {
  Rgb color{1, 1, 1};
  float metallic = 0, roughness = 0.4f, specular = 1;
};

Material coated(const Below& below, float clearcoat, float coat_roughness) {
  return make_material({.kind = MaterialKind::metallic_roughness,
                        .base_color = below.color,
                        .metallic = below.metallic,
                        .roughness = below.roughness,
                        .specular = below.specular,
                        .clearcoat = clearcoat,
                        .clearcoat_roughness = coat_roughness});
}

ShadingPoint point_seen(double degrees) {
  const auto theta = static_cast<float>(degrees * 3.14159265358979 / 180);
  return {.position = {},
          .ng = {0, 0, 1},
          .ns = {0, 0, 1},
          .wo = {0.8f * std::sin(theta), 0.6f * std::sin(theta), std::cos(theta)}};
}

/// A coat that lies flat on what a normal map tilts.
Material on_bumps(Material material) {
  material.coat.normal = {0, 0, 1};
  return material;
}
ShadingPoint bumpy(ShadingPoint point) {
  point.ns = normalize({0.5f, -0.3f, 1});
  return point;
}

test::ChiSquareResult run_chi_square(const Material& sampled, const Material& claimed,
                                     const ShadingPoint& point, double power) {
  const test::SphereGrid grid{
      .axis = normalize(reflect(point.wo, see_coat(claimed, point).point.ns)),
      .num_rings = 32,
      .num_sectors = 32,
      .power = power};
  return test::chi_square_sphere(
      [&](const std::array<float, 4>& u) {
        return sample_bsdf(sampled, point, {u[0], u[1], u[2]});
      },
      [&](const Vec3& wi) { return bsdf_pdf_solid_angle(claimed, point, wi); }, grid, kNumSamples);
}

/// What is reflected of a white sky, red channel, and its standard error; with the sum of all
/// reflection over the density.
std::pair<double, double> albedo(const Material& material, const ShadingPoint& point) {
  double sum = 0, squares = 0;
  for (std::uint32_t i = 0; i < kNumSamples; ++i) {
    const auto u = test::test_uniforms(7, i);
    const Vec3 wi = sample_bsdf(material, point, {u[0], u[1], u[2]});
    const float pdf = bsdf_pdf_solid_angle(material, point, wi);
    if (!(pdf > 0)) continue;
    const double x = static_cast<double>(evaluate_bsdf(material, point, wi).x) *
                         std::max(dot(point.ns, wi), 0.0f) / pdf +
                     static_cast<double>(evaluate_coat(material, point, wi)) / pdf;
    sum += x;
    squares += x * x;
  }
  const double mean_value = sum / kNumSamples;
  return {mean_value,
          std::sqrt(std::max(squares / kNumSamples - mean_value * mean_value, 0.0) / kNumSamples)};
}

double share_of(double clearcoat, double degrees) {
  const double t = 1 - std::cos(degrees * 3.14159265358979 / 180);
  return clearcoat * (0.04 + 0.96 * t * t * t * t * t);
}

TEST(Coat, SamplesFollowTheirDensity) {
  struct Case {
    std::string name;
    Material material;
    double power;
  };
  std::vector<Case> cases;
  for (const float roughness : {0.1f, 0.5f}) {
    const double power = roughness < 0.2f ? 4 : 2;
    cases.push_back({"paint", coated({{0.6f, 0.05f, 0.05f}}, 1, roughness), power});
    cases.push_back({"metal", coated({{0.9f, 0.6f, 0.3f}, 1, 0.3f}, 0.7f, roughness), power});
    cases.push_back({"black", coated({{0, 0, 0}, 0, 1, 0}, 0.5f, roughness), power});
  }
  const std::vector<double> views{0, 40, 75, 89};
  const double level = test::sidak_level(kLevel, static_cast<int>(2 * cases.size() * views.size()));
  for (const Case& c : cases) {
    for (const double view : views) {
      const ShadingPoint flat = point_seen(view);
      EXPECT_GT(run_chi_square(c.material, c.material, flat, c.power).p_value, level)
          << c.name << " under " << view;
      const Material m = on_bumps(c.material);
      EXPECT_GT(run_chi_square(m, m, bumpy(flat), c.power).p_value, level)
          << c.name << " with bumps under " << view;
    }
  }
  // What the test must see.
  const Material m = cases.front().material;
  Material wrong = m;
  wrong.coat.base_albedo *= 0.8f;
  EXPECT_LT(run_chi_square(m, wrong, point_seen(40), 4).p_value, 1e-6);
  wrong = m;
  wrong.coat.alpha *= 1.05f;
  EXPECT_LT(run_chi_square(m, wrong, point_seen(75), 4).p_value, 1e-6);
}

TEST(Coat, DensityIntegratesToOne) {
  for (const double view : {0.0, 60.0, 89.0}) {
    for (const Material& m : {coated({{0.6f, 0.05f, 0.05f}}, 1, 0.2f), coated({}, 0.3f, 0.5f)}) {
      const ShadingPoint point = bumpy(point_seen(view));
      const test::SphereGrid grid{
          .axis = reflect(point.wo, Vec3{0, 0, 1}), .num_rings = 64, .num_sectors = 64, .power = 3};
      double sum = 0;
      for (const double x : grid.integrate(
               [&](const Vec3& wi) { return bsdf_pdf_solid_angle(on_bumps(m), point, wi); }))
        sum += x;
      EXPECT_NEAR(sum, 1, 2e-3) << view;
    }
  }
}

// Furnace: white below, under a white sky. A smooth coat loses nothing.
TEST(Coat, NeverReflectsMoreThanItReceives) {
  for (const float roughness : {0.02f, 0.1f, 0.4f, 1.0f}) {
    for (const float clearcoat : {0.5f, 1.0f}) {
      for (const double view : {0.0, 45.0, 70.0, 80.0, 86.0, 89.0, 89.9}) {
        for (const Below& below : {Below{}, Below{{1, 1, 1}, 0, 0.1f}, Below{{1, 1, 1}, 1, 0.1f},
                                   Below{{1, 1, 1}, 0, 1, 0}}) {
          const Material m = coated(below, clearcoat, roughness);
          const auto [value, error] = albedo(m, point_seen(view));
          EXPECT_LE(value, 1.006 + 5 * error) << roughness << " under " << view;
          if (roughness < 0.2f && below.specular == 0 && view < 87) {
            EXPECT_NEAR(value, 1, 0.01 + 5 * error) << roughness << " under " << view;
          }
        }
      }
    }
  }
}

// f = (1 - s) below + s coat, s = clearcoat (0.04 + 0.96 (1 - n.v)^5).
TEST(Coat, MixesByWhatTheViewerSees) {
  for (const double view : {0.0, 30.0, 60.0, 80.0}) {
    const ShadingPoint point = point_seen(view);
    const Below below{{0.6f, 0.2f, 0.1f}, 0.3f, 0.4f};
    const Material bare = coated(below, 0, 0.1f), m = coated(below, 0.8f, 0.1f);
    const double share = share_of(0.8, view);
    const Vec3 mirror = reflect(point.wo, point.ns);
    for (const Vec3& wi : {mirror, normalize(mirror + Vec3{0.05f, 0, 0.02f})}) {
      const Rgb f = evaluate_bsdf(m, point, wi), bare_f = evaluate_bsdf(bare, point, wi);
      EXPECT_NEAR(f.x, (1 - share) * bare_f.x, 1e-4 * bare_f.x) << view;
      EXPECT_NEAR(f.z, (1 - share) * bare_f.z, 1e-4 * bare_f.z) << view;
      EXPECT_EQ(evaluate_coat(bare, point, wi), 0);
      // The lobe of the coat alone is a white metal of its roughness.
      const Material metal = coated({{1, 1, 1}, 1, 0.1f}, 0, 0.1f);
      const double lobe = evaluate_bsdf(metal, point, wi).x * dot(point.ns, wi);
      EXPECT_NEAR(evaluate_coat(m, point, wi), share * lobe, 1e-4 * share * lobe) << view;
    }
  }
}

TEST(Coat, ItsHorizonIsItsOwn) {
  const ShadingPoint point = bumpy(point_seen(30));
  const Material m = on_bumps(coated({{0.5f, 0.5f, 0.5f}}, 1, 1));
  const Vec3 below_bump = normalize({-1, 0.6f, 0.1f});  // above the coat, below the tilted normal
  EXPECT_LT(dot(point.ns, below_bump), 0);
  EXPECT_EQ(evaluate_bsdf(m, point, below_bump), Rgb{});
  EXPECT_GT(evaluate_coat(m, point, below_bump), 0);
  EXPECT_GT(bsdf_pdf_solid_angle(m, point, below_bump), 0);
  EXPECT_EQ(evaluate_coat(m, point, normalize({1, 0, -0.1f})), 0);
}

TEST(Coat, NothingIsNanOrInfiniteAnywhere) {
  for (const double view : {0.0, 89.999, 90.0, 90.5, 120.0}) {
    ShadingPoint point = point_seen(view);
    point.ng = normalize(point.ns + point.wo * 2.0f);  // on the side of wo
    for (const Material& m : {coated({}, 1, 0.02f), on_bumps(coated({}, 0.5f, 0.3f)),
                              coated({{0, 0, 0}, 0, 0.5f, 0}, 1e-6f, 1)}) {
      for (std::uint32_t i = 0; i < 4000; ++i) {
        const auto u = test::test_uniforms(11, i);
        const ShadingPoint p = i % 2 == 0 ? point : bumpy(point);
        for (const Vec3& wi : {sample_bsdf(m, p, {u[0], u[1], u[2]}),
                               normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f})}) {
          const float pdf = bsdf_pdf_solid_angle(m, p, wi), coat = evaluate_coat(m, p, wi);
          ASSERT_TRUE(std::isfinite(pdf) && pdf >= 0) << view;
          ASSERT_TRUE(std::isfinite(coat) && coat >= 0) << view;
          ASSERT_TRUE(coat < 1e-6f || pdf > 0) << view;
        }
      }
    }
  }
}

}  // namespace
}  // namespace baton
