// The corners where SIMD and scalar code are easily told apart: sharp lobes and views below the
// shading horizon.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "worker/light/candidates.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

struct Pair {
  float simd_f, scalar_f, simd_pdf, scalar_pdf;
};

Pair evaluate_both(const Material& material, const ShadingPoint& point, const Vec3& wi) {
  SiteBlock sites;
  sites.clear(1);
  sites.add(0, point, material);
  const std::int32_t site = 0;
  Pair p{};
  float unused[2];
  kernels::evaluate_bsdf(sites, {&site, 1}, {&wi.x, 1}, {&wi.y, 1}, {&wi.z, 1}, {&p.simd_f, 1},
                         {unused, 1}, {unused + 1, 1}, {&p.simd_pdf, 1});
  p.scalar_f = evaluate_bsdf(material, point, wi).x * std::max(dot(point.ns, wi), 0.0f);
  p.scalar_pdf = bsdf_pdf_solid_angle(material, point, wi);
  return p;
}

TEST(Corners, VerySharpPhongKeepsItsDigits) {
  MaterialSpec spec;
  spec.kind = MaterialKind::phong;
  spec.exponent = 100000;
  const Vec3 n{0, 1, 0};
  const Vec3 wo = normalize(Vec3{0.4f, 1, 0.3f});
  const Vec3 mirror = reflect(wo, n);
  for (const float offset : {0.0f, 0.001f, 0.003f, 0.006f}) {
    const Vec3 wi = normalize(mirror + Vec3{offset, 0, -offset});
    const Pair p =
        evaluate_both(make_material(spec), {.position = {}, .ng = n, .ns = n, .wo = wo}, wi);
    EXPECT_NEAR(p.simd_f, p.scalar_f, 2e-3f * p.scalar_f) << offset;
    EXPECT_NEAR(p.simd_pdf, p.scalar_pdf, 2e-3f * p.scalar_pdf) << offset;
  }
}

TEST(Corners, MetalSeenFromBelowItsShadingHorizon) {
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  spec.metallic = 1;
  spec.roughness = 0.4f;
  const Vec3 ns{0, 1, 0};
  const Vec3 wo = normalize(Vec3{1, -0.05f, 0});
  const ShadingPoint point{.position = {}, .ng = normalize(Vec3{0.3f, 1, 0}), .ns = ns, .wo = wo};
  for (const float y : {0.05f, 0.3f, 1.0f}) {
    const Pair p = evaluate_both(make_material(spec), point, normalize(Vec3{-0.5f, y, 0.2f}));
    EXPECT_TRUE(std::isfinite(p.simd_f));
    EXPECT_NEAR(p.simd_f, p.scalar_f, 1e-6f + 5e-3f * p.scalar_f) << y;
    EXPECT_NEAR(p.simd_pdf, p.scalar_pdf, 1e-6f + 5e-3f * p.scalar_pdf) << y;
  }
}

}  // namespace
}  // namespace baton
