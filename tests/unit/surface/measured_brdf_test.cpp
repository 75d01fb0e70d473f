#include "common/scene/material/measured_brdf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/philox.h"
#include "tests/support/merl_file.h"
#include "worker/surface/bsdf.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using test::phong_by_angles;
using test::write_merl;
using testing::HasSubstr;

const Vec3 kNormal{0, 0, 1};

Vec3 random_above(const Rng& rng, std::uint32_t index) {
  const auto u = rng.uniforms(0, index);
  const float z = 0.05f + 0.95f * u[0];
  const float r = std::sqrt(1 - z * z);
  return {r * std::cos(2 * kPi * u[1]), r * std::sin(2 * kPi * u[1]), z};
}

fs::path temporary(const std::string& name) {
  return fs::path(testing::TempDir()) / ("baton_merl_" + name + ".binary");
}

std::string error_of(const fs::path& path) {
  const auto loaded = MeasuredBrdf::load(path.string());
  fs::remove(path);
  return loaded ? "" : loaded.error().message;
}

TEST(MeasuredBrdf, AFileHoldsWhatWasTabulated) {
  const auto function = phong_by_angles({0.3f, 0.2f, 0.1f}, {0.5f, 0.4f, 0.3f}, 20);
  const fs::path path = temporary("round_trip");
  write_merl(path, function);
  const auto loaded = MeasuredBrdf::load(path.string());
  fs::remove(path);
  ASSERT_TRUE(loaded.ok());
  const auto direct = MeasuredBrdf::tabulate(function);
  for (std::size_t i = 0; i < 4 * MeasuredBrdf::kEntries; ++i) {
    ASSERT_NEAR((*loaded)->texels()[i], direct->texels()[i], 1e-6f * direct->texels()[i]) << i;
  }
}

TEST(MeasuredBrdf, WrongFilesAreNamedWithWhatWasExpected) {
  const auto grey = [](float, float, float) { return Rgb{0.1f, 0.1f, 0.1f}; };
  EXPECT_THAT(error_of(temporary("missing")), HasSubstr("baton_merl_missing.binary"));

  write_merl(temporary("dimensions"), grey, {90, 90, 90});
  EXPECT_THAT(error_of(temporary("dimensions")),
              HasSubstr("dimensions 90 x 90 x 90, expected 90 x 90 x 180"));

  write_merl(temporary("short"), grey, {90, 90, 180}, 1);
  EXPECT_THAT(error_of(temporary("short")), HasSubstr("34992011 bytes, expected 34992012"));

  write_merl(temporary("negative"), [](float, float, float) { return Rgb{-1, -1, -1}; });
  EXPECT_THAT(error_of(temporary("negative")), HasSubstr("no value is positive"));

  std::ofstream(temporary("tiny")) << "abc";
  EXPECT_THAT(error_of(temporary("tiny")), HasSubstr("3 bytes, expected"));
}

TEST(MeasuredBrdf, ATableOfAPhongLobeIsThePhongLobe) {
  const Material phong =
      make_material({.kind = MaterialKind::phong, .kd = 0.5f, .ks = 0.5f, .exponent = 20});
  const auto table = MeasuredBrdf::tabulate(phong_by_angles(phong.kd, phong.ks, 20));
  const Rng rng({.job_seed = 1}, PassId::reference);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const Vec3 wi = random_above(rng, 2 * i);
    const Vec3 wo = random_above(rng, 2 * i + 1);
    const Rgb expected =
        evaluate_bsdf(phong, {.position = {}, .ng = kNormal, .ns = kNormal, .wo = wo}, wi);
    const Rgb got = table->evaluate(kNormal, wi, wo);
    ASSERT_NEAR(got.x, expected.x, 0.01f * expected.x + 0.002f) << i;
    ASSERT_NEAR(got.z, expected.z, 0.01f * expected.z + 0.002f) << i;
  }
}

TEST(MeasuredBrdf, LightAndViewMayChangePlaces) {
  const auto table = MeasuredBrdf::tabulate([](float h, float d, float p) {
    return Rgb{h + d, d + std::sin(p), 1 + p};
  });
  const Rng rng({.job_seed = 2}, PassId::reference);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Vec3 wi = random_above(rng, 2 * i);
    const Vec3 wo = random_above(rng, 2 * i + 1);
    const Rgb there = table->evaluate(kNormal, wi, wo);
    const Rgb back = table->evaluate(kNormal, wo, wi);
    ASSERT_NEAR(there.x, back.x, 1e-3f) << i;
    ASSERT_NEAR(there.z, back.z, 2e-2f) << i;  // phi_d turns fast near theta_d = 0
  }
}

TEST(MeasuredBrdf, TheFittedLobeResemblesThePeak) {
  for (const float alpha : {0.1f, 0.3f}) {
    const auto ggx = [alpha](float theta_h, float, float) {
      const float c = std::cos(theta_h);
      const float t = c * c * (alpha * alpha - 1) + 1;
      const float d = alpha * alpha / (kPi * t * t);
      return Rgb{1, 1, 1} * (0.25f * d + 0.1f * kInvPi);
    };
    const auto lobe = MeasuredBrdf::tabulate(ggx)->fit_lobe();
    EXPECT_NEAR(lobe.alpha, alpha, 0.15f * alpha);
    EXPECT_GT(lobe.share, 0.7f);
    EXPECT_LE(lobe.share, 0.9f);
  }
  EXPECT_EQ(MeasuredBrdf::tabulate([](float, float, float) {
              return Rgb{1, 1, 1};
            })
                ->fit_lobe()
                .share,
            0);
}

}  // namespace
}  // namespace baton
