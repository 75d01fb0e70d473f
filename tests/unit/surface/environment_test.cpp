#include "worker/surface/environment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/scene/map/map_report.h"
#include "tests/support/chi_square.h"

namespace baton {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;
constexpr int kNumSamples = 200000;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

RgbImage grey_image(int width, int height, float value) {
  return {width, height, std::vector<float>(static_cast<std::size_t>(width) * height * 3, value)};
}

void set_texel(RgbImage& image, int i, int j, const Rgb& c) {
  float* texel = &image.rgb[(static_cast<std::size_t>(j) * image.width + i) * 3];
  texel[0] = c.x;
  texel[1] = c.y;
  texel[2] = c.z;
}

RgbImage random_image(int width, int height, std::uint32_t seed) {
  RgbImage image = grey_image(width, height, 0);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const float u = test::test_uniforms(seed, static_cast<std::uint32_t>(i))[0];
    image.rgb[i] = 0.05f + u * u * u * 8;
  }
  return image;
}

RgbImage sun_image() {
  RgbImage image = random_image(32, 16, 5);
  set_texel(image, 20, 4, {1e5f, 1e5f, 9e4f});
  set_texel(image, 21, 4, {1e5f, 1e5f, 9e4f});
  return image;
}

RgbImage one_lit_texel(int i, int j) {
  RgbImage image = grey_image(32, 16, 0);
  set_texel(image, i, j, {3, 2, 1});
  return image;
}

/// Direction of the place (x, y) in texels: the mapping of the header, written a second time.
Vec3 direction_at(double x, double y, int width, int height) {
  const double longitude = (0.5 - x / width) * 2 * kPiDouble;
  const double polar = y / height * kPiDouble;
  return {static_cast<float>(std::sin(polar) * std::sin(longitude)),
          static_cast<float>(std::cos(polar)),
          static_cast<float>(std::sin(polar) * std::cos(longitude))};
}

/// Half texels: every cell of either table is a union of these.
struct HalfTexels {
  int width, height;
  std::size_t count() const { return std::size_t{4} * static_cast<std::size_t>(width) * height; }
  std::size_t index_of(const Vec3& w) const {
    const double u = 0.5 - std::atan2(double{w.x}, double{w.z}) / (2 * kPiDouble);
    const double v = std::atan2(std::hypot(double{w.x}, double{w.z}), double{w.y}) / kPiDouble;
    const int i = std::min(static_cast<int>(u * 2 * width), 2 * width - 1);
    const int j = std::min(static_cast<int>(v * 2 * height), 2 * height - 1);
    return static_cast<std::size_t>(j) * 2 * width + i;
  }
  /// Integral of a map's density over one of them: along a parallel it is linear; down, by Gauss's
  /// rule of two points in each of four zones.
  double probability(const EnvironmentMap& map, std::size_t index) const {
    constexpr int kZones = 4;
    const auto columns = static_cast<std::size_t>(2 * width);
    const double x = (static_cast<double>(index % columns) + 0.5) / 2;
    const double top = static_cast<double>(index / columns) / 2, step = 0.5 / kZones;
    double sum = 0;
    for (int k = 0; k < kZones; ++k) {
      for (const double side : {-1.0, 1.0}) {
        const double y = top + (k + 0.5 + 0.5 * side / std::sqrt(3.0)) * step;
        sum += double{map.evaluate(direction_at(x, y, width, height)).density} *
               std::sin(y / height * kPiDouble);
      }
    }
    return sum * 0.5 * step * kPiDouble / height * kPiDouble / width;
  }
};

std::vector<double> cell_probabilities(const EnvironmentMap& map) {
  const HalfTexels cells{map.width(), map.height()};
  std::vector<double> probability(cells.count());
  for (std::size_t c = 0; c < probability.size(); ++c) probability[c] = cells.probability(map, c);
  return probability;
}

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum;
}

test::ChiSquareResult run_chi_square(const EnvironmentMap& sampled, const EnvironmentMap& claimed) {
  const HalfTexels cells{sampled.width(), sampled.height()};
  std::vector<double> expected = cell_probabilities(claimed);
  std::vector<double> observed(expected.size(), 0.0);
  for (std::uint32_t i = 0; i < kNumSamples; ++i) {
    const auto u = test::test_uniforms(2, i);
    observed[cells.index_of(sampled.sample({u[0], u[1]}))] += 1;
  }
  for (double& e : expected) e *= kNumSamples;
  return test::chi_square_test(observed, expected);
}

struct Case {
  std::string name;
  RgbImage image;
  bool compensate = false;
};

std::vector<Case> all_cases() {
  RgbImage hole = grey_image(32, 16, 1);
  set_texel(hole, 7, 9, {0, 0, 0});
  return {{"random", random_image(32, 16, 5)},
          {"random, compensated", random_image(32, 16, 5), true},
          {"sun", sun_image()},
          {"sun, compensated", sun_image(), true},
          {"one lit texel", one_lit_texel(31, 5)},
          {"lit pole", one_lit_texel(3, 0)},
          {"one dark texel", hole},
          {"constant, compensated", grey_image(32, 16, 1), true},
          {"one texel", grey_image(1, 1, 2)},
          {"one row", random_image(8, 1, 6)},
          {"one column", random_image(1, 8, 6)}};
}

constexpr MapFilter kFilters[] = {MapFilter::nearest, MapFilter::bilinear};

TEST(Environment, SamplesFollowTheDensityThatEvaluateReports) {
  const std::vector<Case> cases = all_cases();
  const double level = test::sidak_level(0.01, static_cast<int>(2 * cases.size()));
  for (const Case& c : cases) {
    for (const MapFilter filter : kFilters) {
      const EnvironmentMap map(c.image, filter, 1, c.compensate);
      const auto result = run_chi_square(map, map);
      EXPECT_GT(result.p_value, level)
          << c.name << ": chi2 " << result.statistic << " of " << result.degrees_of_freedom;
    }
  }
}

/// Tilted, and not on a texel's edge.
const HiddenCone kTiltedCone{.axis = {0.6f, -0.8f, 0}, .angle = 1.0f};

bool is_inside(const HiddenCone& cone, const Vec3& w) {
  return dot(w, {cone.axis[0], cone.axis[1], cone.axis[2]}) >= std::cos(cone.angle);
}

TEST(Environment, WhatIsHiddenIsSeenAndNotSampled) {
  for (const MapFilter filter : kFilters) {
    for (const bool compensate : {false, true}) {
      const RgbImage image = random_image(64, 32, 5);
      const EnvironmentMap plain(image, filter, 1, compensate);
      const EnvironmentMap map(image, filter, 1, compensate, kTiltedCone);
      EXPECT_GT(run_chi_square(map, map).p_value, 0.001);
      EXPECT_LT(run_chi_square(plain, map).p_value, 1e-6);
      EXPECT_NEAR(sum_of(cell_probabilities(map)), 1, 1e-5);
      EXPECT_LT(map.total_power(), 0.85 * plain.total_power());

      int hidden = 0, inside = 0;
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const auto u = test::test_uniforms(8, i);
        EXPECT_FALSE(
            is_inside({kTiltedCone.axis, kTiltedCone.angle - 0.3f}, map.sample({u[0], u[1]})));
        const float y = 1 - 2 * u[0], r = std::sqrt(1 - y * y), phi = 2 * kPi * u[1];
        const Vec3 w{r * std::sin(phi), y, r * std::cos(phi)};
        const EnvironmentMap::Texel light = map.evaluate(w);
        EXPECT_EQ(light.g, plain.evaluate(w).g);
        if (light.is_hidden()) {
          EXPECT_TRUE(is_inside(kTiltedCone, w));
          EXPECT_EQ(light.density, 0);
        }
        hidden += light.is_hidden() ? 1 : 0;
        inside += is_inside(kTiltedCone, w) ? 1 : 0;
      }
      EXPECT_GT(hidden, 0.7 * inside) << "cells at the edge apart, all";

      // A mixture hides the same.
      const EnvironmentMap other(random_image(64, 32, 6), filter, 1, compensate, kTiltedCone);
      const EnvironmentMap mixed(map, other, 0.3f, 2, compensate);
      for (std::uint32_t i = 0; i < 2000; ++i) {
        const auto u = test::test_uniforms(9, i);
        const Vec3 w = normalize({u[0] - 0.5f, u[1] - 0.5f, 0.3f});
        EXPECT_EQ(mixed.evaluate(w).is_hidden(), map.evaluate(w).is_hidden());
      }
    }
  }
}

/// Share of the density that goes by capped radiance.
constexpr float kCapped = 0.1f;

/// What is above `most` (mean over RGB) is scaled down to it.
RgbImage capped(RgbImage image, double most) {
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    const double mean = (double{image.rgb[i]} + image.rgb[i + 1] + image.rgb[i + 2]) / 3;
    for (std::size_t c = i; mean > most && c < i + 3; ++c)
      image.rgb[c] = static_cast<float>(image.rgb[c] * most / mean);
  }
  return image;
}

// A tenth of the directions go by radiance capped at the map's mean.
TEST(Environment, ACappedShareIsLeftToWhatIsNoLamp) {
  for (const RgbImage& image : {random_image(32, 16, 5), sun_image(), grey_image(8, 4, 2)}) {
    for (const MapFilter filter : kFilters) {
      const EnvironmentMap plain(image, filter, 1, false);
      const EnvironmentMap map(image, filter, 1, false, {}, kCapped);
      const double power = plain.total_power(), mean = power / (4 * kPiDouble);
      const double capped_power =
          EnvironmentMap(capped(image, mean), filter, 1, false).total_power();
      const double brightest = *std::ranges::max_element(image.rgb);
      EXPECT_EQ(map.total_power(), power);
      for (int j = 0; j < image.height; ++j) {
        for (int i = 0; i < image.width; ++i) {
          const Vec3 w = direction_at(i + 0.5, j + 0.5, image.width, image.height);
          const float* const rgb = &image.rgb[3 * (static_cast<std::size_t>(j) * image.width + i)];
          const double light = (double{rgb[0]} + rgb[1] + rgb[2]) / 3;
          const double expected = (1 - double{kCapped}) * light / power +
                                  kCapped * std::min(light, mean) / capped_power;
          // Beside a sun a float's rounding of the place tells.
          const double slack = filter == MapFilter::nearest ? 0 : 2e-6 * brightest / power;
          ASSERT_NEAR(map.evaluate(w).density, expected, 1e-4 * expected + slack) << i << ", " << j;
          ASSERT_EQ(map.evaluate(w).g, plain.evaluate(w).g);
        }
      }
    }
  }
}

TEST(Environment, SamplesOfCappedLightFollowTheirDensity) {
  constexpr int kTests = 14;
  const double level = test::sidak_level(0.01, kTests);
  const auto expect_right = [&](const EnvironmentMap& map, const std::string& name) {
    const auto result = run_chi_square(map, map);
    EXPECT_GT(result.p_value, level)
        << name << ": chi2 " << result.statistic << " of " << result.degrees_of_freedom;
    EXPECT_NEAR(sum_of(cell_probabilities(map)), 1, 1e-5) << name;
  };
  for (const MapFilter filter : kFilters) {
    for (const Case& c : all_cases()) {
      if (!c.compensate && c.image.width >= 8)
        expect_right({c.image, filter, 1, false, {}, kCapped}, c.name);
    }
    const RgbImage image = sun_image();
    const EnvironmentMap hidden(image, filter, 1, false, kTiltedCone, kCapped);
    expect_right(hidden, "hidden");
    const EnvironmentMap other(random_image(32, 16, 6), filter, 1, false, kTiltedCone, kCapped);
    expect_right({hidden, other, 0.3f, 2, false, kCapped}, "mixed");

    // The machinery sees a table that forgets the share.
    const EnvironmentMap plain(image, filter, 1, false);
    const EnvironmentMap map(image, filter, 1, false, {}, kCapped);
    EXPECT_LT(run_chi_square(plain, map).p_value, 1e-6);
    EXPECT_LT(run_chi_square(map, plain).p_value, 1e-6);
  }
}

TEST(Environment, ChiSquareSeesAWrongTable) {
  RgbImage other = random_image(32, 16, 5);
  for (int i = 0; i < 32; ++i) set_texel(other, i, 8, {6, 6, 6});
  for (const MapFilter filter : kFilters) {
    const EnvironmentMap map(random_image(32, 16, 5), filter, 1, false);
    EXPECT_LT(run_chi_square(map, EnvironmentMap(other, filter, 1, false)).p_value, 1e-6);
    EXPECT_LT(run_chi_square(map, EnvironmentMap(random_image(32, 16, 5), filter, 1, true)).p_value,
              1e-6);
  }
}

TEST(Environment, DensityIntegratesToOne) {
  for (const Case& c : all_cases()) {
    for (const MapFilter filter : kFilters) {
      EXPECT_NEAR(sum_of(cell_probabilities(EnvironmentMap(c.image, filter, 1, c.compensate))), 1,
                  1e-5)
          << c.name;
    }
  }
  const EnvironmentMap large(random_image(1024, 512, 9), MapFilter::bilinear, 1, false);
  EXPECT_NEAR(sum_of(cell_probabilities(large)), 1, 1e-5);
}

// Light that a table foresees all but for its place in the cell is noise of all pixels together.
TEST(Environment, DensityIsTheMeanRadianceOverThePower) {
  for (const RgbImage& image : {random_image(32, 16, 5), sun_image(), random_image(1, 3, 7)}) {
    const EnvironmentMap map(image, MapFilter::bilinear, 2, false);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const auto u = test::test_uniforms(11, i);
      const auto [r, g, b, density] = map.evaluate(map.sample({u[0], u[1]}));
      ASSERT_NEAR((r + g + b) / 3 / density / map.total_power(), 1, 1e-5);
    }
  }
}

TEST(Environment, EverySampleHasPositiveDensityAndLight) {
  for (const int width : {32, 2048}) {
    for (const MapFilter filter : kFilters) {
      RgbImage image = grey_image(width, width / 2, 0);
      set_texel(image, width - 1, width / 5, {1, 1, 1});
      const EnvironmentMap map(image, filter, 1, false);
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const auto u = test::test_uniforms(4, i);
        // The corners of the unit square are the edges of the cells.
        const float a = i % 3 == 0 ? u[0] * 1e-6f : i % 3 == 1 ? 0x1.fffffep-1f : u[0];
        const Vec3 w = map.sample({a, u[1]});
        ASSERT_NEAR(length(w), 1, 1e-6f);
        ASSERT_GT(map.evaluate(w).density, 0);
        ASSERT_TRUE(filter == MapFilter::bilinear || map.evaluate(w).r == 1);
      }
    }
  }
}

TEST(Environment, DensityIsPositiveWhereverThereIsLight) {
  RgbImage image = grey_image(64, 32, 1e-30f);
  set_texel(image, 10, 10, {1e30f, 1e30f, 1e30f});
  for (const MapFilter filter : kFilters) {
    const EnvironmentMap map(image, filter, 1, false);
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 256; ++x) {
        const auto texel = map.evaluate(direction_at((x + 0.5) / 4, (y + 0.5) / 4, 64, 32));
        ASSERT_TRUE(texel.r > 0 && texel.density > 0) << x << ", " << y;
      }
    }
  }
}

TEST(Environment, EvaluateGivesTexelsAtTheirCentres) {
  RgbImage image = random_image(32, 16, 8);
  for (const MapFilter filter : kFilters) {
    const EnvironmentMap map(image, filter, 2, false);
    for (int j = 0; j < 16; ++j) {
      for (int i = 0; i < 32; ++i) {
        const auto texel = map.evaluate(direction_at(i + 0.5, j + 0.5, 32, 16));
        const float* expected = &image.rgb[(static_cast<std::size_t>(j) * 32 + i) * 3];
        const float tolerance = filter == MapFilter::nearest ? 0.0f : 5e-4f;
        EXPECT_NEAR(texel.r, 2 * expected[0], tolerance);
        EXPECT_NEAR(texel.g, 2 * expected[1], tolerance);
        EXPECT_NEAR(texel.b, 2 * expected[2], tolerance);
      }
    }
  }
}

TEST(Environment, BilinearMixesNeighboursAndWrapsAround) {
  RgbImage image = grey_image(4, 4, 0);
  set_texel(image, 0, 1, {1, 1, 1});
  set_texel(image, 3, 1, {3, 3, 3});
  const EnvironmentMap map(image, MapFilter::bilinear, 1, false);
  EXPECT_NEAR(map.evaluate(direction_at(0, 1.5, 4, 4)).r, 2, 1e-5f);  // the seam: half of both
  EXPECT_NEAR(map.evaluate(direction_at(4, 1.5, 4, 4)).r, 2, 1e-5f);
  EXPECT_NEAR(map.evaluate(direction_at(1, 1.5, 4, 4)).r, 0.5f, 1e-5f);
  EXPECT_NEAR(map.evaluate(direction_at(0.5, 2, 4, 4)).r, 0.5f, 1e-5f);
}

TEST(Environment, FollowsTheLatLongMapping) {
  // +Z is the centre of the picture, +X a quarter to its left, +Y the top.
  RgbImage image = grey_image(4, 3, 0);
  set_texel(image, 2, 1, {1, 0, 0});  // just right of the centre: -X is at u = 3/4
  set_texel(image, 0, 1, {0, 1, 0});
  const EnvironmentMap map(image, MapFilter::nearest, 1, false);
  EXPECT_EQ(map.evaluate(normalize({-0.1f, 0, 1})).r, 1);
  EXPECT_EQ(map.evaluate(normalize({0.1f, 0, -1})).g, 1);
  EXPECT_EQ(map.evaluate({0, 1, 0}).r, 0);
  EXPECT_EQ(map.evaluate({0, -1, 0}).r, 0);
}

TEST(Environment, TotalPowerIsTheIntegralOfTheRadiance) {
  EXPECT_NEAR(EnvironmentMap(grey_image(16, 8, 2), MapFilter::nearest, 3, false).total_power(),
              24 * kPiDouble, 1e-9);
  EXPECT_NEAR(EnvironmentMap(grey_image(16, 8, 2), MapFilter::bilinear, 3, true).total_power(),
              24 * kPiDouble, 1e-9);
}

TEST(Environment, WhatIsNoRadianceIsBlack) {
  RgbImage image = grey_image(8, 4, 1);
  set_texel(image, 0, 0, {-1, 1, 1});
  set_texel(image, 1, 0, {kNan, -1, kInfinity});
  set_texel(image, 2, 0, {kInfinity, 1, 1});
  set_texel(image, 3, 0, {1, 1, -kInfinity});
  set_texel(image, 4, 0, {2e38f, 1, 1});  // finite, but not after the scale
  const EnvironmentMap map(image, MapFilter::nearest, 2, false);
  EXPECT_EQ(report_map("m", image, 2, 0).repaired_texels, 5u);
  const auto texel = map.evaluate(direction_at(0.5, 0.5, 8, 4));
  EXPECT_EQ(texel.r, 0);
  EXPECT_EQ(texel.g, 2);
  EXPECT_NEAR(sum_of(cell_probabilities(map)), 1, 1e-5);
}

TEST(Environment, HugeTexelsStayFinite) {
  const EnvironmentMap map(grey_image(8, 4, 3e38f), MapFilter::bilinear, 1, false);
  EXPECT_TRUE(std::isfinite(map.total_power()));
  EXPECT_FALSE(map.black());
  EXPECT_NEAR(sum_of(cell_probabilities(map)), 1, 1e-5);
}

TEST(Environment, BlackMapHasNoDensity) {
  for (const MapFilter filter : kFilters) {
    for (const float value : {0.0f, -1.0f, kNan}) {
      const EnvironmentMap map(grey_image(8, 4, value), filter, 1, true);
      EXPECT_TRUE(map.black());
      EXPECT_EQ(sum_of(cell_probabilities(map)), 0);
    }
  }
}

TEST(Environment, CompensationDropsWhatIsBelowTheMean) {
  RgbImage image = grey_image(8, 4, 1);
  set_texel(image, 2, 2, {100, 100, 100});
  const EnvironmentMap map(image, MapFilter::nearest, 1, true);
  EXPECT_EQ(map.evaluate(direction_at(6.5, 1.5, 8, 4)).density, 0);
  EXPECT_GT(map.evaluate(direction_at(2.5, 2.5, 8, 4)).density, 0);
  const EnvironmentMap constant(grey_image(8, 4, 0.1f), MapFilter::bilinear, 1, true);
  EXPECT_NEAR(constant.evaluate({0, 0, 1}).density, 1 / (4 * kPiDouble), 1e-6);
}

TEST(Environment, BlendInterpolatesTexels) {
  const EnvironmentMap a(random_image(32, 16, 1), MapFilter::bilinear, 1, false);
  const EnvironmentMap b(random_image(32, 16, 2), MapFilter::bilinear, 1, false);
  const Vec3 w = normalize({0.3f, -0.4f, 0.8f});
  EXPECT_EQ(EnvironmentMap(a, b, 0, 1, false).evaluate(w).g, a.evaluate(w).g);
  EXPECT_EQ(EnvironmentMap(a, b, 1, 1, false).evaluate(w).g, b.evaluate(w).g);
  const EnvironmentMap middle(a, b, 0.25f, 1, false);
  EXPECT_NEAR(EnvironmentMap(a, a, 0, 3, false).evaluate(w).g, 3 * a.evaluate(w).g, 1e-5f);
  EXPECT_NEAR(middle.evaluate(w).g, 0.75f * a.evaluate(w).g + 0.25f * b.evaluate(w).g, 1e-5f);
  EXPECT_GT(run_chi_square(middle, middle).p_value, 0.001);
}

TEST(Environment, SamplingIsMonotone) {
  const EnvironmentMap map(random_image(16, 8, 3), MapFilter::bilinear, 1, false);
  float previous = 2;
  for (int i = 0; i < 1000; ++i) {
    const float y = map.sample({static_cast<float>(i) / 1000, 0.3f}).y;
    EXPECT_LE(y, previous);
    previous = y;
  }
}

TEST(Environment, RotationTurnsDirectionsNotTexels) {
  const auto map =
      std::make_shared<const EnvironmentMap>(sun_image(), MapFilter::bilinear, 1.0f, false);
  const Environment turned{map, rotation_about({0, 1, 0}, 90)};
  // What the map shows along +Z is now seen along +X.
  EXPECT_NEAR(turned.evaluate({1, 0, 0}).r, map->evaluate({0, 0, 1}).r, 1e-3f);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const auto u = test::test_uniforms(6, i);
    const Vec3 w = map->sample({u[0], u[1]});
    const Vec3 world = turned.sample({u[0], u[1]});
    ASSERT_NEAR(dot(turned.rotation * w, world), 1, 1e-6f);
    ASSERT_EQ(turned.evaluate(world).density, map->evaluate(w).density);
  }
}

}  // namespace
}  // namespace baton
