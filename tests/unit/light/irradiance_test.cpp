#include "worker/light/irradiance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "common/math/vec3.h"
#include "tests/support/chi_square.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

Environment environment_of(const RgbImage& image, MapFilter filter, const Mat3& rotation = {}) {
  return {std::make_shared<const EnvironmentMap>(image, filter, 1, false), rotation};
}

TEST(Irradiance, OfAConstantSkyIsPi) {
  RgbImage image{.width = 8, .height = 4, .rgb = std::vector<float>(3 * 32, 2.0f)};
  const Rgb e = irradiance(environment_of(image, MapFilter::bilinear), normalize({1, 2, 3}));
  EXPECT_NEAR(e.x, 2 * kPi, 1e-4f);
  EXPECT_NEAR(e.z, 2 * kPi, 1e-4f);
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
