// The pool of a pixel against the scalar arithmetic, on every instruction set of this machine.
#include "worker/integrator/pool_kernels.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <memory>
#include <vector>

#include "worker/sampling/pool.h"
#include "worker/scene/material.h"

namespace baton {
namespace {

using kernels::CandidateCounts;
using kernels::PoolHalf;

Environment turned_sky(float degrees, float brightness) {
  RgbImage image{32, 16, {}};
  for (int i = 0; i < 32 * 16 * 3; ++i)
    image.rgb.push_back(brightness * static_cast<float>(1 + (i * 37) % 23));
  return {std::make_shared<EnvironmentMap>(image, MapFilter::bilinear, 1.0f, false),
          rotation_about({0, 1, 0}, degrees)};
}

Material material_of(MaterialKind kind) {
  MaterialSpec spec;
  spec.kind = kind;
  spec.base_color = {0.8f, 0.5f, 0.3f};
  spec.roughness = 0.4f;
  return make_material(spec);
}

/// A pixel that sees three things, one of its four sites nothing.
struct Pixel {
  std::vector<Material> materials{material_of(MaterialKind::diffuse),
                                  material_of(MaterialKind::phong),
                                  material_of(MaterialKind::metallic_roughness)};
  std::vector<ShadingPoint> points;
  SiteBlock sites;

  explicit Pixel(float tilt) {
    sites.clear(4);
    for (int s = 0; s < 3; ++s) {
      const Vec3 normal = normalize({tilt * static_cast<float>(s), 1, 0.2f});
      points.push_back(
          {.position = {}, .ng = normal, .ns = normal, .wo = normalize({0.3f, 0.8f, 0.4f})});
      sites.add(s, points.back(), materials[static_cast<std::size_t>(s)]);
    }
    sites.add_miss(3);
  }
  float target(std::size_t site, const Environment& light, const Vec3& w) const {
    const EnvironmentMap::Texel seen = light.evaluate(w);
    const float cosine = std::max(dot(points[site].ns, w), 0.0f);
    return mean(evaluate_bsdf(materials[site], points[site], w) * Rgb{seen.r, seen.g, seen.b}) *
           cosine;
  }
};

class Pool : public testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override {
    hwy::SetSupportedTargetsForTest(GetParam());
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (std::size_t bin = 0; bin < kVisibilityBins; bin += 2) {
      memory[bin] = static_cast<VisibilityCell>(bin << 8 | 3);
    }
    memory[kVisibilitySummary] = 3000 << 4 | 15;
    for (std::uint32_t j = 0; j < 16; ++j) {
      code.push_back((j + 1) * 2654435761u);
      site.push_back(static_cast<std::uint8_t>(j % 3));
      u.push_back(0.1f * static_cast<float>(j + 1));
    }
    old.sites = old_pixel.sites;
    old.log_share[1] = -std::log(2.0f);
  }
  void TearDown() override {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }

  void gather(bool has_history) {
    kernels::gather_pool({.sites = now_pixel.sites,
                          .old = &old,
                          .now = now,
                          .before = before,
                          .light_pool = light_pool,
                          .counts = counts,
                          .has_history = has_history,
                          .code = code,
                          .site = site,
                          .contribution = u,
                          .memory = memory},
                         settings, Rng({.job_seed = 5}, PassId::candidates), *halves);
  }
  /// Relative difference of an entry's weight from the scalar one; carried: contribution of the
  /// particle, or 0.
  double deviation(const PoolHalf& half, std::size_t i, float carried, float gain) const {
    const auto s = static_cast<std::size_t>(half.site[i]);
    const Vec3 w = now.rotation * decode_octahedral(half.code[i]);
    const float target = now_pixel.target(s, now, w);
    const float target_before =
        old_pixel.target(s, before, before.rotation * decode_octahedral(half.code[i])) *
        std::exp(old.log_share[s]);
    const float proposal = static_cast<float>(counts.from_light) * now.evaluate(w).density +
                           static_cast<float>(counts.from_bsdf) *
                               bsdf_pdf_solid_angle(now_pixel.materials[s], now_pixel.points[s], w);
    const float expected = carried > 0
                               ? carried_weight(gain, target_before, target, carried)
                               : 0.75f * fresh_weight(gain, target_before, target, proposal);
    return std::fabs(half.weight[i] - expected) / (expected + 1e-4);
  }

  Pixel now_pixel{0.1f}, old_pixel{0.15f};
  OldSurfaces old;
  Environment now = turned_sky(30, 1), before = turned_sky(28, 0.7f);
  LightPool light_pool = make_light_pool(now, before, 3, 2, {.carried = CarriedFrame::environment});
  CandidateCounts counts{.from_light = 24, .from_bsdf = 8};
  PoolSettings settings{.num_carried = 16, .gain = 2};
  std::vector<VisibilityCell> memory = std::vector<VisibilityCell>(kVisibilityCells, 0);
  std::vector<OctDirection> code;
  std::vector<std::uint8_t> site;
  std::vector<float> u;
  std::unique_ptr<std::array<PoolHalf, 2>> halves = std::make_unique<std::array<PoolHalf, 2>>();
};

std::vector<std::int64_t> available_targets() {
  std::vector<std::int64_t> targets;
  for (const std::int64_t target : {HWY_SSE4, HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) != 0) targets.push_back(target);
  }
  return targets;
}
INSTANTIATE_TEST_SUITE_P(Sets, Pool, testing::ValuesIn(available_targets()), [](const auto& param) {
  return std::string(hwy::TargetName(param.param));
});

TEST_P(Pool, WeightsAreThoseOfTheScalarCode) {
  for (const bool has_history : {false, true}) {
    gather(has_history);
    for (std::size_t h = 0; h < 2; ++h) {
      const PoolHalf& half = (*halves)[h];
      const std::size_t num_carried = has_history ? 8 : 0;
      ASSERT_EQ(half.count, static_cast<std::int32_t>(num_carried + 32));
      int far_off = 0;
      double sum = 0;
      for (std::size_t i = 0; i < num_carried + 32; ++i) {
        const float carried = i >= 32 ? 2 * u[8 * h + i - 32] : 0;
        far_off += deviation(half, i, carried, has_history ? settings.gain : 0) > 2e-3 ? 1 : 0;
        sum += half.weight[i];
      }
      EXPECT_LE(far_off, 1);  // a direction on a cell's edge
      EXPECT_NEAR(half.lns, sum, 1e-4 * sum);
      if (!has_history) {
        EXPECT_NEAR(half.lns_fresh, half.lns, 1e-5 * half.lns);
      }
    }
  }
}

TEST_P(Pool, ReadsTheMemoryAsTheScalarCode) {
  gather(true);
  for (const PoolHalf& half : *halves) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(half.count); ++i) {
      const float free = free_share(memory, visibility_bin({half.x[i], half.y[i], half.z[i]}));
      EXPECT_NEAR(half.free[i], free, 1e-6f);
      EXPECT_NEAR(half.carry_weight[i], half.weight[i] * carry_factor(free),
                  1e-5f * half.weight[i]);
      EXPECT_NEAR(half.ray_weight[i], half.weight[i] * ray_factor(free), 1e-5f * half.weight[i]);
    }
  }
}

// Whatever the balance, the fresh candidates by themselves are those of a first frame.
TEST_P(Pool, FreshCandidatesEstimateLnsAlone) {
  gather(false);
  const float alone = (*halves)[0].lns_fresh;
  gather(true);
  EXPECT_NEAR((*halves)[0].lns_fresh, alone, 1e-4f * alone);
  EXPECT_NE((*halves)[0].lns, alone);
}

TEST_P(Pool, HalvesShareNoCandidate) {
  gather(false);
  for (std::int32_t i = 24; i < 32; ++i) {
    for (std::int32_t j = 24; j < 32; ++j) EXPECT_NE((*halves)[0].code[i], (*halves)[1].code[j]);
  }
}

}  // namespace
}  // namespace baton
