#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/scene/map/map_reduction.h"
#include "tests/support/chi_square.h"
#include "worker/surface/environment.h"

namespace baton {
namespace {

TEST(MakeMap, AMapThatIsNarrowEnoughStaysAsItIs) {
  RgbImage map{32, 16, std::vector<float>(std::size_t{3} * 32 * 16)};
  for (std::size_t i = 0; i < map.rgb.size(); ++i) {
    const float u = test::test_uniforms(3, static_cast<std::uint32_t>(i))[0];
    map.rgb[i] = 0.05f + 100 * std::pow(u, 8.0f);
  }
  EnvironmentSpec environment;
  environment.scale = 3;
  const EnvironmentMap plain(map, environment.filter, environment.scale, false);
  for (const int max_width : {0, 32, 100}) {
    environment.max_width = max_width;
    const EnvironmentMap made = make_map(map, environment, false);
    ASSERT_EQ(made.width(), 32);
    EXPECT_TRUE(std::equal(
        plain.texels(), plain.texels() + 34 * 18, made.texels(), [](const auto& a, const auto& b) {
          return a.r == b.r && a.g == b.g && a.b == b.b && a.density == b.density;
        }));
  }
  environment.max_width = 8;
  const EnvironmentMap coarse = make_map(map, environment, false);
  EXPECT_EQ(coarse.width(), 8);
  EXPECT_EQ(coarse.height(), 4);
  EXPECT_EQ(map_sides(32, 16, 8), (std::array{8, 4}));
  EXPECT_EQ(map_sides(32, 16, 0), (std::array{32, 16}));
  EXPECT_NEAR(coarse.total_power(), plain.total_power(), 0.05 * plain.total_power());
}

}  // namespace
}  // namespace baton
