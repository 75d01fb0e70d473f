// The kernels of `restir` and `ratio` against others that say the same, on every instruction set of
// this machine.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/instruction_sets.h"
#include "worker/light/frame_light.h"
#include "worker/method/carried/carried_light.h"
#include "worker/method/ratio/ratio_kernels.h"
#include "worker/method/restir/restir_kernels.h"
#include "worker/surface/bsdf.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

Environment sky(double turned_deg) {
  RgbImage image{32, 16, {}};
  for (int i = 0; i < 32 * 16 * 3; ++i) image.rgb.push_back(static_cast<float>(1 + (i * 37) % 23));
  return {std::make_shared<EnvironmentMap>(image, MapFilter::bilinear, 1.0f, false),
          rotation_about({0, 1, 0}, turned_deg)};
}

/// Three sites that see something and one that does not.
SiteBlock pixel(float tilt) {
  const MaterialKind kinds[] = {MaterialKind::diffuse, MaterialKind::phong,
                                MaterialKind::metallic_roughness};
  SiteBlock sites;
  sites.clear(4);
  for (int s = 0; s < 3; ++s) {
    MaterialSpec spec{.kind = kinds[s], .base_color = {0.8f, 0.5f, 0.3f}, .roughness = 0.4f};
    const Vec3 normal = normalize({tilt * static_cast<float>(s), 1, 0.2f});
    sites.add(s, {.position = {}, .ng = normal, .ns = normal, .wo = normalize({0.3f, 0.8f, 0.4f})},
              make_material(spec));
  }
  sites.add_miss(3);
  return sites;
}

class BaselineKernels : public OnInstructionSet {
 protected:
  void SetUp() override {
    OnInstructionSet::SetUp();
    for (std::uint32_t i = 0; i < kernels::RestirPoints::kMost; ++i) {
      points_->code[i] = (i + 1) * 2654435761u;
      points_->site[i] = static_cast<std::uint8_t>(i % 4);
      points_->r[i] = points_->target_now[i] = points_->target_before[0][i] =
          points_->target_before[1][i] = kUntouched;
    }
  }

  /// Mean over RGB of what point i, turned back, reflects, by the kernels that everybody uses.
  float target(const SiteBlock& sites, const EnvironmentView& light, std::size_t i,
               const Mat3& turn = {}) const {
    const Vec3 w = turn.transposed() * decode_octahedral(points_->code[i]);
    const std::int32_t site = points_->site[i];
    float l[4], f[4];
    const auto one = [](const float& v) { return std::span(&v, 1); };
    const auto out = [](float& v) { return std::span(&v, 1); };
    kernels::evaluate_environment(light, one(w.x), one(w.y), one(w.z), out(l[0]), out(l[1]),
                                  out(l[2]), out(l[3]));
    kernels::evaluate_bsdf(sites, std::span(&site, 1), one(w.x), one(w.y), one(w.z), out(f[0]),
                           out(f[1]), out(f[2]), out(f[3]));
    return (l[0] * f[0] + l[1] * f[1] + l[2] * f[2]) / 3;
  }

  static constexpr float kUntouched = -7;
  const Environment now_ = sky(30), before_ = sky(20);
  const PresampledLight light_pool_ = presample_light(now_, before_, 3, 2);
  const std::unique_ptr<kernels::RestirPoints> points_ = std::make_unique<kernels::RestirPoints>();
};

INSTANTIATE_TEST_SUITE_P(Sets, BaselineKernels, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

// Two carried sets: of the same surfaces, and of others of which each two heirs share.
TEST_P(BaselineKernels, PointsAreEvaluatedInTheirRangeAlone) {
  const SiteBlock sites = pixel(0.1f);
  OldSurfaces other{.sites = pixel(0.5f)};
  other.log_share.fill(-std::log(2.0f));
  const OldSurfaces* const old[] = {nullptr, &other};
  for (const bool still : {false, true}) {
    const EnvironmentView now = view_of(now_), before = still ? now : view_of(before_);
    const kernels::CarriedLight light{before, now, still, light_pool_};
    for (const std::size_t first_old : {0u, 1u}) {
      SetUp();
      constexpr std::size_t kFirst = 5, kLast = 5 + 83;
      kernels::evaluate_points(
          sites, old, light,
          {.first = kFirst, .last = kLast, .wants_now = true, .first_old = first_old}, *points_);
      for (std::size_t i = 0; i < 120; ++i) {
        const bool inside = i >= kFirst && i < kLast;
        const auto expect = [&](float got, float wanted, bool asked) {
          if (!inside || !asked) wanted = kUntouched;
          EXPECT_NEAR(got, wanted, 1e-5f * (1 + std::fabs(wanted))) << i;
        };
        expect(points_->target_now[i], target(sites, now, i), true);
        expect(points_->target_before[0][i], target(sites, before, i), first_old == 0);
        expect(points_->target_before[1][i], target(other.sites, before, i) / 2, true);
        if (!inside) {
          EXPECT_EQ(points_->r[i], kUntouched);
        }
      }
    }
  }
}

// The density of what was drawn before a map turned is that of then: of its light and surfaces.
TEST_P(BaselineKernels, PointsThatTurnedAreSeenFromWhereTheyCame) {
  const SiteBlock sites = pixel(0.1f);
  OldSurfaces other{.sites = pixel(0.5f)};
  other.log_share.fill(-std::log(2.0f));
  const OldSurfaces* const old[] = {nullptr, &other};
  const EnvironmentView now = view_of(now_), before = view_of(before_);
  const std::optional<Mat3> turn = turn_between(before_, now_);
  ASSERT_TRUE(turn);
  constexpr std::size_t kLast = 83;
  kernels::evaluate_points(
      sites, old, {.before = before, .now = now, .presampled = light_pool_, .turn = &*turn},
      {.first = 0, .last = kLast, .wants_now = true}, *points_);
  for (std::size_t i = 0; i < kLast; ++i) {
    const auto expect = [&](float got, float wanted) {
      EXPECT_NEAR(got, wanted, 1e-4f * (1 + std::fabs(wanted))) << i;
    };
    expect(points_->target_now[i], target(sites, now, i));
    expect(points_->target_before[0][i], target(sites, before, i, *turn));
    expect(points_->target_before[1][i], target(other.sites, before, i, *turn) / 2);
  }
}

TEST_P(BaselineKernels, DirectionsTurnInTheirRangeAlone) {
  const Mat3 turn = rotation_about({0.3f, 1, -0.2f}, 7);
  constexpr std::size_t kFirst = 5, kLast = 5 + 83;
  kernels::turn_points(turn, kFirst, kLast, *points_);
  for (std::uint32_t i = 0; i < 120; ++i) {
    const OctDirection code = (i + 1) * 2654435761u;
    const Vec3 turned = turn * decode_octahedral(code);
    if (i >= kFirst && i < kLast) {
      EXPECT_LT(length(decode_octahedral(points_->code[i]) - turned), 1.01 * kOctahedralError);
    } else {
      EXPECT_EQ(points_->code[i], code);
    }
  }
}

TEST(TurnBetween, KnowsHowABilinearMapTurnedUnlessItIsNextToNothing) {
  const std::optional<Mat3> turn = turn_between(sky(20), sky(30));
  ASSERT_TRUE(turn);
  EXPECT_LT(length(*turn * Vec3{0, 0, 1} - rotation_about({0, 1, 0}, 10) * Vec3{0, 0, 1}), 1e-6f);
  EXPECT_TRUE(turn_between(sky(0), sky(180)));
  EXPECT_TRUE(turn_between(sky(20), sky(19.9)));
  EXPECT_FALSE(turn_between(sky(20), sky(20.05)));
  EXPECT_FALSE(turn_between(sky(20), sky(20)));

  Environment nearest = sky(20);
  nearest.map =
      std::make_shared<EnvironmentMap>(RgbImage{1, 1, {1, 1, 1}}, MapFilter::nearest, 1.0f, false);
  EXPECT_FALSE(turn_between(nearest, {nearest.map, rotation_about({0, 1, 0}, 90)}));
}

// The sum of the weights is theirs alone, however the two kinds of candidates fill their vectors.
TEST_P(BaselineKernels, CandidatesOfAnyNumberIgnoreWhatTheSetHeld) {
  const SiteBlock sites = pixel(0.1f);
  const Rng rng({.job_seed = 5}, PassId::candidates);
  const auto set = std::make_unique<kernels::CandidateSet>();
  for (std::int32_t from_light = 0; from_light <= 17; ++from_light) {
    for (std::int32_t from_bsdf = from_light == 0 ? 1 : 0; from_bsdf <= 17; ++from_bsdf) {
      for (std::size_t i = 0; i < 64; ++i) set->weight[i] = kUntouched;
      kernels::draw_candidates({sites,
                                view_of(now_),
                                light_pool_,
                                {.from_light = from_light, .from_bsdf = from_bsdf},
                                rng.bits(0, 0)},
                               *set);
      double sum = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(set->count); ++i) sum += set->weight[i];
      ASSERT_NEAR(set->total, sum, 1e-5 * sum) << from_light << " + " << from_bsdf;
    }
  }
}

// Without shadows the ratio estimator is the sum of all candidates, per channel.
TEST_P(BaselineKernels, FreeRaysOfTheRatioBringAllCandidates) {
  const SiteBlock sites = pixel(0.1f);
  const kernels::CandidateCounts counts{.from_light = 40, .from_bsdf = 24, .lobe_only = true};
  const Rng rng({.job_seed = 5}, PassId::candidates);
  const auto set = std::make_unique<kernels::CandidateSet>();
  kernels::draw_candidates({sites, view_of(now_), light_pool_, counts, rng.bits(0, 0)}, *set);
  Rgb wanted;
  for (std::size_t i = 0; i < static_cast<std::size_t>(set->count); ++i) {
    const Rgb reflected{set->r[i], set->g[i], set->b[i]};
    if (set->weight[i] > 0) wanted += reflected * (set->weight[i] / mean(reflected));
  }

  const auto scratch = std::make_unique<kernels::ChoiceScratch>();
  const auto rays = std::make_unique<PixelRays>();
  const float lns = kernels::choose_ratio_rays(
      {sites, view_of(now_), light_pool_, counts, rng.bits(0, 0)}, 0.3f, 16, *scratch, *rays);
  EXPECT_NEAR(lns, set->total, 1e-5f * set->total);
  EXPECT_LE(rays->count, 16u);
  Rgb sum;
  float visibility = 0;
  for (std::size_t j = 0; j < rays->count; ++j) {
    sum += {rays->r[j], rays->g[j], rays->b[j]};
    visibility += rays->visibility[j];
  }
  EXPECT_NEAR(sum.x, wanted.x, 1e-4f * wanted.x);
  EXPECT_NEAR(sum.y, wanted.y, 1e-4f * wanted.y);
  EXPECT_NEAR(sum.z, wanted.z, 1e-4f * wanted.z);
  EXPECT_NEAR(visibility, 1, 1e-5);
  EXPECT_EQ(rays->constant.visibility, 0);
}

// Light so dim that a candidate's colour is no normal number: each counts by its share of all.
TEST_P(BaselineKernels, RaysOfTheRatioAreNumbersInTheDark) {
  RgbImage image{32, 16, std::vector<float>(32 * 16 * 3, 1.0f)};
  const Environment night{
      std::make_shared<EnvironmentMap>(image, MapFilter::bilinear, 1e-9f, false), Mat3()};
  const PresampledLight light = presample_light(night, night, 3, 2);
  SiteBlock sites;
  sites.clear(1);
  const MaterialSpec gloss{.kind = MaterialKind::phong, .kd = 0};
  sites.add(0, {.position = {}, .ng = {0, 1, 0}, .ns = {0, 1, 0}, .wo = normalize({1, 0.3f, 0})},
            make_material(gloss));
  const auto scratch = std::make_unique<kernels::ChoiceScratch>();
  const auto rays = std::make_unique<PixelRays>();
  std::size_t num_rays = 0;
  for (std::uint32_t seed = 0; seed < 500; ++seed) {
    const Rng rng({.job_seed = seed}, PassId::candidates);
    kernels::choose_ratio_rays({sites, view_of(night), light, {.from_light = 1}, rng.bits(0, 0)},
                               0.3f, 1, *scratch, *rays);
    num_rays += rays->count;
    for (std::size_t j = 0; j < rays->count; ++j)
      ASSERT_TRUE(std::isfinite(rays->r[j] + rays->g[j] + rays->b[j])) << seed;
  }
  EXPECT_GT(num_rays, 100u);
}

}  // namespace
}  // namespace baton
