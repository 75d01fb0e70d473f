// Measured BRDFs in SIMD against the scalar code, beside other materials in one pixel.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/merl_file.h"
#include "worker/light/candidates.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

TEST(MeasuredKernels, MixedSitesAsTheScalarCode) {
  const std::array<Material, 4> materials{
      make_material({.kind = MaterialKind::metallic_roughness, .roughness = 0.4f}),
      make_measured_material(MeasuredBrdf::tabulate(
          test::phong_by_angles({0.3f, 0.2f, 0.1f}, {0.5f, 0.4f, 0.3f}, 20))),
      make_material({}),
      make_measured_material(MeasuredBrdf::tabulate(
          test::phong_by_angles({0.1f, 0.5f, 0.2f}, {0.1f, 0.2f, 0.4f}, 80)))};
  const Vec3 n{0, 1, 0};
  for (const Vec3& wo : {normalize(Vec3{0.3f, 0.9f, 0.2f}), normalize(Vec3{1, 0.1f, 0.3f})}) {
    const ShadingPoint point{.position = {}, .ng = n, .ns = n, .wo = wo};
    SiteBlock sites;
    sites.clear(4);
    for (int s = 0; s < 4; ++s) sites.add(s, point, materials[static_cast<std::size_t>(s)]);

    // Directions over the sphere, sites in turn.
    constexpr std::size_t kCount = 4003;
    std::vector<float> x, y, z, r(kCount), g(kCount), b(kCount), pdf(kCount);
    std::vector<std::int32_t> site;
    const Rng rng({.job_seed = 7}, PassId::reference);
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const auto u = rng.uniforms(0, i);
      const float height = 2 * u[0] - 1;
      const float radius = std::sqrt(1 - height * height);
      x.push_back(radius * std::cos(2 * kPi * u[1]));
      y.push_back(height);
      z.push_back(radius * std::sin(2 * kPi * u[1]));
      site.push_back(static_cast<std::int32_t>(i % 4));
    }
    kernels::evaluate_bsdf(sites, site, x, y, z, r, g, b, pdf);
    for (std::size_t i = 0; i < kCount; ++i) {
      const Vec3 wi{x[i], y[i], z[i]};
      const Rgb f = evaluate_bsdf(materials[i % 4], point, wi) * std::max(wi.y, 0.0f);
      ASSERT_NEAR(r[i], f.x, 2e-3f * f.x + 1e-4f) << "site " << i % 4 << " direction " << i;
      ASSERT_NEAR(g[i], f.y, 2e-3f * f.y + 1e-4f) << "site " << i % 4 << " direction " << i;
      ASSERT_NEAR(b[i], f.z, 2e-3f * f.z + 1e-4f) << "site " << i % 4 << " direction " << i;
      const float density = bsdf_pdf_solid_angle(materials[i % 4], point, wi);
      ASSERT_NEAR(pdf[i], density, 2e-3f * density + 1e-4f)
          << "site " << i % 4 << " direction " << i;
    }
  }
}

}  // namespace
}  // namespace baton
