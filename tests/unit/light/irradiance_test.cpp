#include "worker/light/irradiance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/math/vec3.h"
#include "tests/support/chi_square.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

Environment environment_of(const RgbImage& image, MapFilter filter, const Mat3& rotation = {}) {
  return {std::make_shared<const EnvironmentMap>(image, filter, 1, false), rotation};
}
Rgb irradiance(const Environment& environment, const Vec3& normal) {
  return Irradiance(*environment.map).at(environment, normal);
}

/// The same point by point.
std::array<double, 3> plain_sum(const Environment& environment, const Vec3& normal) {
  const EnvironmentMap& map = *environment.map;
  const int per_column = (1024 + map.width() - 1) / map.width();
  const int per_row = (512 + map.height() - 1) / map.height();
  const int columns = map.width() * per_column, rows = map.height() * per_row;
  const Vec3 n = environment.rotation.transposed() * normal;
  std::array<double, 3> sum{};
  for (int j = 0; j < rows; ++j) {
    const double step = std::numbers::pi / rows, theta = (j + 0.5) * step;
    const double area =
        (std::cos(j * step) - std::cos((j + 1) * step)) * 2 * std::numbers::pi / columns;
    for (int i = 0; i < columns; ++i) {
      const double longitude = (0.5 - (i + 0.5) / columns) * 2 * std::numbers::pi;
      const std::array<double, 3> w{std::sin(theta) * std::sin(longitude), std::cos(theta),
                                    std::sin(theta) * std::cos(longitude)};
      const double cosine = w[0] * double{n.x} + w[1] * double{n.y} + w[2] * double{n.z};
      if (!(cosine > 0)) continue;
      const EnvironmentMap::Texel texel =
          per_column == 1 && per_row == 1
              ? map.texels()[static_cast<std::size_t>(j + 1) *
                                 static_cast<std::size_t>(map.stride()) +
                             static_cast<std::size_t>(i + 1)]
              : map.evaluate(
                    {static_cast<float>(w[0]), static_cast<float>(w[1]), static_cast<float>(w[2])});
      sum[0] += area * cosine * double{texel.r};
      sum[1] += area * cosine * double{texel.g};
      sum[2] += area * cosine * double{texel.b};
    }
  }
  return sum;
}

TEST(Irradiance, OfAConstantSkyIsPi) {
  RgbImage image{.width = 8, .height = 4, .rgb = std::vector<float>(3 * 32, 2.0f)};
  const Rgb e = irradiance(environment_of(image, MapFilter::bilinear), normalize({1, 2, 3}));
  EXPECT_NEAR(e.x, 2 * kPi, 1e-4f);
  EXPECT_NEAR(e.z, 2 * kPi, 1e-4f);
}

/// Noise with a sun of one texel, so bright that it gives most of the light.
RgbImage sunny(int width, int height, float sun) {
  RgbImage image{width, height, {}};
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(width * height); ++i) {
    const auto u = test::test_uniforms(7, i);
    image.rgb.insert(image.rgb.end(), {u[0] * u[0], u[1], 0.2f});
  }
  float* const texel = &image.rgb[3 * static_cast<std::size_t>(height / 4 * width + width / 3)];
  for (std::size_t c = 0; c < 3; ++c) texel[c] = sun;
  return image;
}

// Every normal has the sum over all points: small maps and large ones, of odd sizes, turned, with a
// small sun in all of the sky; normals that have the sun at their horizon, too.
TEST(Irradiance, IsTheSumOverAllPointsForEveryNormal) {
  struct Case {
    int width, height;
    float sun;
  };
  for (const auto [width, height, sun] : {Case{2, 1, 1}, Case{64, 32, 5000}, Case{33, 17, 0},
                                          Case{1500, 700, 1e6f}, Case{2048, 1024, 1e7f}}) {
    for (const MapFilter filter : {MapFilter::bilinear, MapFilter::nearest}) {
      if (width != 33 && filter == MapFilter::nearest) continue;
      const Environment sky = environment_of(sunny(width, height, sun), filter,
                                             rotation_about(normalize({1, 2, 0.5f}), 40));
      const Irradiance irradiance(*sky.map);
      const double longitude = (0.5 - (width / 3 + 0.5) / width) * 2 * std::numbers::pi;
      const double theta = (height / 4 + 0.5) * std::numbers::pi / height;
      const Vec3 to_sun =
          sky.rotation * Vec3{static_cast<float>(std::sin(theta) * std::sin(longitude)),
                              static_cast<float>(std::cos(theta)),
                              static_cast<float>(std::sin(theta) * std::cos(longitude))};
      const Frame frame(to_sun);
      for (std::uint32_t k = 0; k < 9; ++k) {
        const auto u = test::test_uniforms(3, k);
        const float up = k < 5 ? 2 * u[0] - 1 : 0.004f * (u[0] - 0.5f);
        const float around = 2 * kPi * u[1], out = std::sqrt(1 - up * up);
        const Vec3 normal = frame.to_world({out * std::cos(around), out * std::sin(around), up});
        const Rgb e = irradiance.at(sky, normal);
        const std::array<double, 3> expected = plain_sum(sky, normal);
        EXPECT_NEAR(double{e.x} / expected[0], 1, 5e-5) << width << " normal " << k;
        EXPECT_NEAR(double{e.y} / expected[1], 1, 5e-5) << width << " normal " << k;
        EXPECT_NEAR(double{e.z} / expected[2], 1, 5e-5) << width << " normal " << k;
      }
    }
  }
}

TEST(Irradiance, OfLightFromOneSideIsNoneOnTheOther) {
  RgbImage image = test::constant_map(16, 8, {0, 0, 0});
  for (std::size_t i = 0; i < 3 * 16; ++i) image.rgb[i] = 1;  // about the zenith
  const Environment sky = environment_of(image, MapFilter::nearest);
  EXPECT_EQ(irradiance(sky, {0, -1, 0}), Rgb{});
  EXPECT_GT(irradiance(sky, {0, 1, 0}).x, 0.4f);
}

// Beside samples of the map: hypothesis equal means, |z| < 4, in six cases; two uniforms a sample.
TEST(Irradiance, AgreesWithSamplesOfTheMap) {
  for (const MapFilter filter : {MapFilter::bilinear, MapFilter::nearest}) {
    for (const float degrees : {0.0f, 40.0f, 200.0f}) {
      const Environment sky =
          environment_of(test::sky_map(), filter, rotation_about(normalize({1, 2, 0.5f}), degrees));
      const Vec3 normal = normalize({0.3f, 1, -0.4f});
      const Rgb e = irradiance(sky, normal);
      double sum = 0, squares = 0;
      constexpr int kCount = 200000;
      for (std::uint32_t i = 0; i < kCount; ++i) {
        const auto u = test::test_uniforms(5, i);
        const Vec3 w = sky.sample({u[0], u[1]});
        const EnvironmentMap::Texel texel = sky.evaluate(w);
        const double value =
            double{texel.r} * std::max(0.0f, dot(normal, w)) / double{texel.density};
        sum += value / kCount;
        squares += value * value / kCount;
      }
      const double error = std::sqrt((squares - sum * sum) / kCount);
      EXPECT_NEAR(double{e.x}, sum, 4 * error + 5e-4 * sum) << degrees;
      EXPECT_LT(error, 0.005 * sum);
    }
  }
}

}  // namespace
}  // namespace baton
