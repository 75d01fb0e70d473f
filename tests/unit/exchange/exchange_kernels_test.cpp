// The second pass's inner loops against the scalar code.
#include "worker/exchange/exchange_kernels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/merl_file.h"

namespace baton {
namespace {

/// Directions over the sphere.
std::vector<OctDirection> random_codes(std::size_t count) {
  std::vector<OctDirection> codes;
  const Rng rng({.job_seed = 11}, PassId::reference);
  for (std::uint32_t i = 0; i < count; ++i) codes.push_back(rng.bits(0, i)[0]);
  return codes;
}

Environment checkered_environment() {
  RgbImage image{16, 8, {}};
  for (int i = 0; i < 16 * 8 * 3; ++i) image.rgb.push_back(static_cast<float>((i * 37) % 23));
  return {std::make_shared<EnvironmentMap>(image, MapFilter::bilinear, 1.0f, false),
          rotation_about({0.2f, 1, 0.1f}, 33)};
}

TEST(ExchangeKernels, LightsAsTheScalarCode) {
  const std::vector<OctDirection> codes = random_codes(1003);
  const Environment environment = checkered_environment();
  std::vector<LightRecord> lights(codes.size());
  kernels::look_up_lights(view_of(environment), codes, lights);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const Vec3 w = decode_octahedral(codes[i]);
    const EnvironmentMap::Texel t = environment.evaluate(w);
    ASSERT_LT(length(lights[i].direction - w), 4e-7f);
    ASSERT_NEAR(lights[i].radiance.x, t.r, 2e-3f) << i;
    ASSERT_NEAR(lights[i].radiance.y, t.g, 2e-3f) << i;
    ASSERT_NEAR(lights[i].radiance.z, t.b, 2e-3f) << i;
  }
}

// Runs of one material and mixtures, each channel another: whole vectors without a lobe, with one
// kind, with all kinds.
TEST(ExchangeKernels, ReflectionsAsTheScalarCode) {
  const std::vector<Material> materials{
      make_material({.base_color = {0.2f, 0.5f, 0.8f}}),
      make_material({.kind = MaterialKind::phong,
                     .base_color = {0.9f, 0.5f, 0.2f},
                     .specular_color = {0.3f, 0.7f, 1},
                     .kd = 0.5f,
                     .ks = 0.4f,
                     .exponent = 50}),
      make_material({.kind = MaterialKind::metallic_roughness,
                     .base_color = {1, 0.7f, 0.3f},
                     .metallic = 0.3f,
                     .roughness = 0.4f,
                     .specular = 0.4f}),
      make_measured_material(MeasuredBrdf::tabulate(
          test::phong_by_angles({0.3f, 0.2f, 0.1f}, {0.5f, 0.4f, 0.3f}, 20))),
      make_material({.kind = MaterialKind::metallic_roughness,
                     .base_color = {0.7f, 0.1f, 0.1f},
                     .clearcoat = 1.0f,
                     .clearcoat_roughness = 0.3f}),
      make_material({.kind = MaterialKind::metallic_roughness, .base_color = {0.4f, 0.5f, 0.6f}})};
  const ShadingPoint point{.position = {},
                           .ng = {0, 1, 0},
                           .ns = normalize(Vec3{0.1f, 1, 0.2f}),
                           .wo = normalize(Vec3{0.3f, 0.9f, 0.2f})};
  SurfaceTable surfaces;
  for (std::size_t k = 0; k < materials.size(); ++k)
    surfaces.add(point, materials[k], {static_cast<float>(k), 2, 3});
  surfaces.add_nothing();

  const std::vector<OctDirection> codes = random_codes(4003);
  std::vector<LightRecord> lights(codes.size());
  kernels::look_up_lights(view_of(checkered_environment()), codes, lights);
  std::vector<Offer> offers;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const std::size_t surface = i < 1400 ? i / 200 : i % 7;
    offers.push_back({.sample = static_cast<std::uint32_t>(i),
                      .receiver = 0,
                      .surface = static_cast<std::uint32_t>(surface)});
  }
  std::vector<Reflected> reflected(offers.size() + kReceptionPadding), again = reflected;
  kernels::reflect_lights(surfaces, lights, offers, reflected);
  OfferRays rays;
  kernels::reflect_and_cast(surfaces, lights, offers, again, rays);
  int shining = 0;
  std::size_t ray = 0;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const std::size_t surface = offers[i].surface;
    const Vec3& wi = lights[i].direction;
    Rgb expected;
    if (surface < materials.size() && dot(point.ng, wi) > 0)
      expected = (evaluate_bsdf(materials[surface], point, wi) * std::max(dot(point.ns, wi), 0.0f) +
                  Rgb{1, 1, 1} * evaluate_coat(materials[surface], point, wi)) *
                 lights[i].radiance;
    const Rgb got = reflected[i].radiance;
    ASSERT_NEAR(got.x, expected.x, 2e-3f * expected.x + 1e-3f) << surface << " direction " << i;
    ASSERT_NEAR(got.y, expected.y, 2e-3f * expected.y + 1e-3f) << surface << " direction " << i;
    ASSERT_NEAR(got.z, expected.z, 2e-3f * expected.z + 1e-3f) << surface << " direction " << i;
    ASSERT_NEAR(reflected[i].target, mean(got), 1e-6f * mean(got));
    ASSERT_EQ(again[i].radiance, got);
    ASSERT_EQ(again[i].target, reflected[i].target);
    if (!(reflected[i].target > 0)) continue;
    // Each that shines has its ray, in order.
    ++shining;
    ASSERT_LT(ray, rays.rays.size());
    ASSERT_EQ(rays.offer[ray], i);
    const ShadowRays& r = rays.rays;
    ASSERT_EQ((Vec3{r.origin_x[ray], r.origin_y[ray], r.origin_z[ray]}),
              (Vec3{static_cast<float>(surface), 2, 3}));
    ASSERT_EQ((Vec3{r.direction_x[ray], r.direction_y[ray], r.direction_z[ray]}), wi);
    ASSERT_GT(r.t_far[ray], 1e30f);
    ++ray;
  }
  EXPECT_GT(shining, 1000);
  EXPECT_EQ(ray, rays.rays.size());
}

// Whole vectors are stored, also when the last offers do not fill one.
TEST(ExchangeKernels, RaysStopAtTheLastOffer) {
  SurfaceTable surfaces;
  surfaces.add({.position = {}, .ng = {0, 1, 0}, .ns = {0, 1, 0}, .wo = {0, 1, 0}},
               make_material({}), {4, 2, 3});
  const std::vector<LightRecord> lights{{.direction = {0, 1, 0}, .radiance = {1, 1, 1}}};
  std::vector<Reflected> reflected(17 + kReceptionPadding);
  OfferRays rays;
  for (std::size_t count = 0; count <= 17; ++count) {
    const std::vector<Offer> offers(count);
    kernels::reflect_and_cast(surfaces, lights, offers, reflected, rays);
    ASSERT_EQ(rays.rays.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(rays.offer[i], i);
      EXPECT_GT(reflected[i].target, 0);
      EXPECT_EQ(rays.rays.direction_y[i], 1);
    }
  }
}

}  // namespace
}  // namespace baton
