#include "worker/surface/bsdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/chi_square.h"
#include "worker/surface/ggx_energy.h"

namespace baton {
namespace {

constexpr int kNumSamples = 200000;
/// Chance that a whole run of a test in this file raises a false alarm.
constexpr double kLevel = 0.01;

Vec3 from_polar(double degrees, double azimuth_degrees = 35) {
  const double theta = degrees * 3.14159265358979 / 180;
  const double phi = azimuth_degrees * 3.14159265358979 / 180;
  return {static_cast<float>(std::sin(theta) * std::cos(phi)),
          static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
}

/// A flat surface with normal `n`, seen under `view_degrees` to it.
ShadingPoint flat_point(double view_degrees, const Vec3& n = {0, 0, 1}) {
  return {.position = {},
          .ng = n,
          .ns = n,
          .wo = normalize(Frame(n).to_world(from_polar(view_degrees)))};
}

Material phong(float kd, float ks, float exponent) {
  return make_material({.kind = MaterialKind::phong,
                        .base_color = {1, 1, 1},
                        .kd = kd,
                        .ks = ks,
                        .exponent = exponent});
}

Material ggx(float metallic, float roughness) {
  return make_material({.kind = MaterialKind::metallic_roughness,
                        .base_color = {1, 1, 1},
                        .metallic = metallic,
                        .roughness = roughness});
}

struct Case {
  std::string name;
  Material material;
  double view_degrees;
  /// How fine the cells are around the mirror direction.
  double grid_power;
};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const double view : {0.0, 30.0, 75.0, 89.0, 89.99}) {
    cases.push_back({"diffuse", make_material({}), view, 1});
    cases.push_back({"phong 1", phong(0, 1, 1), view, 1});
    cases.push_back({"phong 50", phong(0.5f, 0.5f, 50), view, 2});
    cases.push_back({"phong 1000", phong(0.2f, 0.8f, 1000), view, 4});
    cases.push_back({"phong 100000", phong(0, 1, 100000), view, 6});
    cases.push_back({"ggx rough metal", ggx(1, 1), view, 2});
    cases.push_back({"ggx 0.5", ggx(0.5f, 0.5f), view, 2});
    cases.push_back({"ggx dielectric", ggx(0, 0.3f), view, 2});
    cases.push_back({"ggx 0.1 metal", ggx(1, 0.1f), view, 5});
  }
  return cases;
}

test::SphereGrid grid_around_mirror(const ShadingPoint& point, double power) {
  return {.axis = normalize(reflect(point.wo, point.ns)),
          .num_rings = 32,
          .num_sectors = 32,
          .power = power};
}

test::ChiSquareResult run_chi_square(const Material& sampled, const Material& claimed,
                                     const ShadingPoint& point, double power) {
  return test::chi_square_sphere(
      [&](const std::array<float, 4>& u) {
        return sample_bsdf(sampled, point, {u[0], u[1], u[2]});
      },
      [&](const Vec3& wi) { return bsdf_pdf_solid_angle(claimed, point, wi); },
      grid_around_mirror(point, power), kNumSamples);
}

/// Integral of f cos over the upper hemisphere, red channel, and its standard error, through
/// sample_bsdf.
std::pair<double, double> albedo(const Material& material, const ShadingPoint& point) {
  double sum = 0;
  double sum_squares = 0;
  for (std::uint32_t i = 0; i < kNumSamples; ++i) {
    const auto u = test::test_uniforms(7, i);
    const Vec3 wi = sample_bsdf(material, point, {u[0], u[1], u[2]});
    const float pdf = bsdf_pdf_solid_angle(material, point, wi);
    const double x = pdf > 0 ? evaluate_bsdf(material, point, wi).x * dot(point.ns, wi) / pdf : 0.0;
    sum += x;
    sum_squares += x * x;
  }
  const double mean_value = sum / kNumSamples;
  return {mean_value, std::sqrt(std::max(0.0, sum_squares / kNumSamples - mean_value * mean_value) /
                                kNumSamples)};
}

TEST(Material, SamplesFollowTheirDensity) {
  const std::vector<Case> cases = all_cases();
  const double level = test::sidak_level(kLevel, static_cast<int>(cases.size()));
  for (const Case& c : cases) {
    const auto result =
        run_chi_square(c.material, c.material, flat_point(c.view_degrees), c.grid_power);
    EXPECT_GT(result.p_value, level) << c.name << " seen under " << c.view_degrees << ": chi2 "
                                     << result.statistic << " of " << result.degrees_of_freedom;
  }
}

TEST(Material, SamplesFollowTheirDensityAroundTiltedNormals) {
  const std::vector<Vec3> normals{normalize({1, 2, -3}), {0, 0, -1}, normalize({-1, 0.01f, 0})};
  const double level = test::sidak_level(kLevel, static_cast<int>(2 * normals.size()));
  for (const Vec3& n : normals) {
    EXPECT_GT(
        run_chi_square(phong(0.5f, 0.5f, 50), phong(0.5f, 0.5f, 50), flat_point(60, n), 2).p_value,
        level);
    EXPECT_GT(run_chi_square(ggx(0.5f, 0.5f), ggx(0.5f, 0.5f), flat_point(60, n), 2).p_value,
              level);
  }
}

TEST(Material, SamplesFollowTheirDensityWhenTheNormalFacesAway) {
  ShadingPoint point = flat_point(0);
  point.wo = normalize({1, 0, -0.05f});  // 3 degrees behind the shading normal's horizon
  point.ng = normalize({0.2f, 0, 1});
  for (const Material& m : {ggx(1, 0.5f), ggx(0, 0.2f), phong(0.5f, 0.5f, 50)}) {
    EXPECT_GT(run_chi_square(m, m, point, 2).p_value, test::sidak_level(kLevel, 3));
  }
}

TEST(Material, ChiSquareSeesAWrongDensity) {
  constexpr double kAlarm = 1e-6;
  const ShadingPoint point = flat_point(40);
  EXPECT_LT(run_chi_square(phong(0, 1, 50), phong(0, 1, 52.5f), point, 2).p_value, kAlarm);
  EXPECT_LT(run_chi_square(phong(0, 1, 100000), phong(0, 1, 105000), point, 6).p_value, kAlarm);
  EXPECT_LT(run_chi_square(ggx(1, 0.5f), ggx(1, 0.51f), point, 2).p_value, kAlarm);

  Material wrong_mixture = phong(0.5f, 0.5f, 50);
  wrong_mixture.specular_probability += 0.03f;
  EXPECT_LT(run_chi_square(phong(0.5f, 0.5f, 50), wrong_mixture, point, 2).p_value, kAlarm);
}

TEST(Material, DensityIntegratesToOneOverTheSphere) {
  for (const Case& c : all_cases()) {
    const ShadingPoint point = flat_point(c.view_degrees);
    test::SphereGrid grid = grid_around_mirror(point, c.grid_power);
    double sum = 0;
    for (const double x : grid.integrate(
             [&](const Vec3& wi) { return bsdf_pdf_solid_angle(c.material, point, wi); })) {
      sum += x;
    }
    EXPECT_NEAR(sum, 1, 2e-3) << c.name << " seen under " << c.view_degrees;
  }
}

TEST(Material, LambertReflectsExactlyItsAlbedo) {
  const Material m = make_material({.base_color = {0.25f, 0.5f, 0.75f}});
  const ShadingPoint point = flat_point(50);
  // Cosine sampling of a constant f has no variance.
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const auto u = test::test_uniforms(3, i);
    const Vec3 wi = sample_bsdf(m, point, {u[0], u[1], u[2]});
    const float scale = dot(point.ns, wi) / bsdf_pdf_solid_angle(m, point, wi);
    EXPECT_NEAR(evaluate_bsdf(m, point, wi).x * scale, 0.25f, 1e-6f);
    EXPECT_NEAR(evaluate_bsdf(m, point, wi).z * scale, 0.75f, 1e-6f);
  }
}

TEST(Material, PhongReflectsAllWhenSeenFromAboveAndNeverMore) {
  for (const float exponent : {1.0f, 50.0f, 1000.0f, 100000.0f}) {
    const auto [above, error] = albedo(phong(0, 1, exponent), flat_point(0));
    EXPECT_NEAR(above, 1, 5 * error + 1e-4) << exponent;
    for (const double view : {20.0, 60.0, 85.0, 89.9}) {
      const auto [value, e] = albedo(phong(0, 1, exponent), flat_point(view));
      EXPECT_LE(value, 1 + 5 * e + 1e-4) << exponent << " under " << view;
      EXPECT_GT(value, 0);
    }
  }
}

TEST(Material, GgxMetalNeverReflectsMoreThanItReceives) {
  for (const float roughness : {0.02f, 0.1f, 0.3f, 0.6f, 1.0f}) {
    for (const double view : {0.0, 45.0, 80.0, 89.0}) {
      const auto [value, error] = albedo(ggx(1, roughness), flat_point(view));
      EXPECT_LE(value, 1 + 5 * error + 1e-4) << roughness << " under " << view;
      EXPECT_GT(value, 0.3) << roughness << " under " << view;
    }
    // A smooth white metal loses nothing to shadowing.
    if (roughness < 0.2f) {
      EXPECT_NEAR(albedo(ggx(1, roughness), flat_point(45)).first, 1, 0.01);
    }
  }
}

// A white varnished surface under a white sky: what the lobe reflects, the diffuse part lacks.
// Head-on nothing is taken away that glTF's formula has.
TEST(Material, GgxNeverReflectsMoreThanItReceives) {
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  for (const float color : {1.0f, 0.7f}) {
    for (const float roughness : {0.05f, 0.15f, 0.3f, 0.6f, 1.0f}) {
      for (const double view : {0.0, 45.0, 70.0, 80.0, 86.0, 89.0, 89.9}) {
        const Material m = make_material(spec, {color, color, color}, 0, roughness);
        const auto [value, error] = albedo(m, flat_point(view));
        EXPECT_LE(value, 1.006 + 5 * error) << color << ", " << roughness << " under " << view;
        const float cosine = std::cos(static_cast<float>(view) * kPi / 180);
        if (color < 1 && view < 60) {
          EXPECT_EQ(diffuse_left(m, cosine), (Rgb{1, 1, 1})) << roughness << " under " << view;
        }
        if (roughness < 0.2f && view > 80) {
          EXPECT_GT(value, 0.9) << "at least what fits";
        }
      }
    }
  }
}

// glTF 2.0, appendix B.2: mix(dielectric, metal, metallic), of what they reflect.
TEST(Material, BetweenMetalAndNotIsTheMixOfBoth) {
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  for (const float specular : {1.0f, 0.4f, 0.0f}) {
    spec.specular = specular;
    spec.ior = specular < 1 ? 2.0f : 1.5f;
    for (const float roughness : {0.1f, 0.3f, 0.8f}) {
      const auto of = [&](float metallic) {
        return make_material(spec, {1, 0.7f, 0.1f}, metallic, roughness);
      };
      for (const double view : {10.0, 60.0, 85.0, 89.0}) {
        const ShadingPoint point = flat_point(view);
        for (std::uint32_t i = 0; i < 200; ++i) {
          const auto u = test::test_uniforms(5, i);
          const Vec3 wi = sample_bsdf(of(0.5f), point, {u[0], u[1], u[2]});
          const Rgb plain = evaluate_bsdf(of(0), point, wi),
                    metal = evaluate_bsdf(of(1), point, wi);
          for (const float m : {0.01f, 0.3f, 0.5f, 0.9f, 0.999f}) {
            const Rgb got = evaluate_bsdf(of(m), point, wi), mix = plain * (1 - m) + metal * m;
            ASSERT_NEAR(got.x, mix.x, 1e-5f + 1e-4f * mix.x) << m << " under " << view;
            ASSERT_NEAR(got.z, mix.z, 1e-5f + 1e-4f * mix.z) << m << " under " << view;
          }
        }
      }
    }
  }
}

// White under a white sky is the mean of white varnish, which reflects all, and of white metal.
TEST(Material, HalfAMetalReflectsHalfAsMuchLessAsAMetal) {
  for (const float roughness : {0.05f, 0.3f, 0.6f}) {
    for (const double view : {0.0, 45.0, 75.0}) {
      const auto at = [&](float m) { return albedo(ggx(m, roughness), flat_point(view)); };
      const auto [plain, e0] = at(0);
      const auto [half, e1] = at(0.5f);
      const auto [metal, e2] = at(1);
      EXPECT_NEAR(half, (plain + metal) / 2, 5 * (e0 + e1 + e2) + 1e-3) << roughness << " " << view;
    }
  }
}

// KHR_materials_specular: without a lobe the diffuse part gives nothing away.
TEST(Material, GgxWithoutSpecularIsLambertian) {
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  spec.specular = 0;
  const Material m = make_material(spec, {0.5f, 0.5f, 0.5f}, 0, 1);
  for (const double view : {0.0, 60.0, 85.0}) {
    for (const Vec3& wi : {normalize(Vec3{0.1f, 0, 1}), normalize(Vec3{-0.9f, 0.3f, 0.2f})})
      EXPECT_FLOAT_EQ(evaluate_bsdf(m, flat_point(view), wi).x, 0.5f * kInvPi) << view;
  }
}

TEST(Material, BrdfIsReciprocal) {
  const Vec3 a = from_polar(20, 10);
  const Vec3 b = from_polar(65, 200);
  const ShadingPoint from_a{.position = {}, .ng = {0, 0, 1}, .ns = {0, 0, 1}, .wo = a};
  const ShadingPoint from_b{.position = {}, .ng = {0, 0, 1}, .ns = {0, 0, 1}, .wo = b};
  // Grey, of which diffuse_left takes nothing: what it takes of white goes by the viewer alone.
  const Material grey = make_material({.kind = MaterialKind::metallic_roughness,
                                       .base_color = {0.7f, 0.7f, 0.7f},
                                       .metallic = 0.3f,
                                       .roughness = 0.5f});
  for (const Material& m : {make_material({}), phong(0.3f, 0.6f, 5), grey, ggx(1, 0.9f)}) {
    EXPECT_NEAR(evaluate_bsdf(m, from_a, b).x, evaluate_bsdf(m, from_b, a).x, 1e-6f);
  }
}

TEST(Material, KnownValues) {
  // Mirror direction of a phong lobe: ks (s + 2) / (2 pi).
  const ShadingPoint point = flat_point(30);
  const Vec3 mirror = normalize(reflect(point.wo, point.ns));
  EXPECT_NEAR(evaluate_bsdf(phong(0, 1, 50), point, mirror).x, 52 / (2 * kPi), 1e-4f);
  EXPECT_NEAR(bsdf_pdf_solid_angle(phong(0, 1, 50), point, mirror), 51 / (2 * kPi), 1e-4f);

  // White ggx metal, alpha = 1, all along the normal: D = 1/pi, G2 = 1.
  const ShadingPoint above = flat_point(0);
  EXPECT_NEAR(evaluate_bsdf(ggx(1, 1), above, {0, 0, 1}).x, kInvPi / 4, 1e-6f);
}

TEST(Material, BelowEitherHorizonNothingIsReflected) {
  ShadingPoint point = flat_point(30);
  point.ng = normalize({0.5f, 0, 1});
  const Vec3 below_geometric = normalize({-1, 0, 0.2f});
  const Vec3 below_shading = normalize({1, 0, -0.2f});
  for (const Material& m : {make_material({}), phong(0.5f, 0.5f, 1), ggx(0.5f, 1)}) {
    EXPECT_EQ(evaluate_bsdf(m, point, below_geometric), Rgb{});
    EXPECT_EQ(evaluate_bsdf(m, point, below_shading), Rgb{});
  }
}

TEST(Material, NothingIsNanOrInfiniteAnywhere) {
  std::vector<Material> materials;
  for (const Case& c : all_cases()) materials.push_back(c.material);
  materials.push_back(ggx(1, 0.02f));
  for (const double view : {0.0, 45.0, 89.999, 90.0, 90.5, 120.0}) {
    ShadingPoint point = flat_point(view);
    point.ng = normalize(point.ns + point.wo * 2.0f);  // on the side of wo
    for (const Material& m : materials) {
      for (std::uint32_t i = 0; i < 4000; ++i) {
        const auto u = test::test_uniforms(11, i);
        // Samples of the lobe, the corners of the unit cube, directions all over the sphere.
        const std::array<float, 3> corner{i & 1 ? 0x1.fffffep-1f : 0.0f,
                                          i & 2 ? 0x1.fffffep-1f : 0.0f,
                                          i & 4 ? 0x1.fffffep-1f : 0.0f};
        const Vec3 drawn =
            sample_bsdf(m, point, i < 8 ? corner : std::array<float, 3>{u[0], u[1], u[2]});
        const Vec3 anywhere =
            i == 9 ? -point.wo : normalize({u[0] - 0.5f, u[1] - 0.5f, u[2] - 0.5f});
        ASSERT_NEAR(length(drawn), 1, 1e-5f);
        for (const Vec3& wi : {drawn, anywhere}) {
          const float pdf = bsdf_pdf_solid_angle(m, point, wi);
          ASSERT_TRUE(std::isfinite(pdf) && pdf >= 0) << view << " shape " << m.shape;
          const Rgb f = evaluate_bsdf(m, point, wi);
          ASSERT_TRUE(std::isfinite(f.x) && f.x >= 0 && std::isfinite(f.y) && std::isfinite(f.z));
          // Where there is light to find, the sampler can find it.
          const bool matters = f.x * dot(point.ns, wi) > 1e-6f;
          ASSERT_TRUE(!matters || pdf > 0);
        }
      }
    }
  }
}

TEST(Material, SpecularProbabilityFollowsTheAlbedos) {
  EXPECT_EQ(make_material({}).specular_probability, 0);
  EXPECT_EQ(phong(0, 1, 50).specular_probability, 1);
  EXPECT_FLOAT_EQ(phong(0.5f, 0.5f, 50).specular_probability, 0.5f);
  EXPECT_EQ(phong(1, 0, 50).lobe, Material::Lobe::none);
  EXPECT_EQ(phong(0, 0, 50).specular_probability, 0);
  EXPECT_EQ(ggx(1, 0.5f).specular_probability, 1);
  EXPECT_GT(ggx(0, 0.5f).specular_probability, 0.05f);
  EXPECT_LT(ggx(0, 0.5f).specular_probability, 0.2f);
}

}  // namespace
}  // namespace baton
