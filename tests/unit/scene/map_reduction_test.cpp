#include "common/scene/map/map_reduction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/chi_square.h"

namespace baton {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

RgbImage grey_image(int width, int height, float value) {
  return {width, height, std::vector<float>(std::size_t{3} * width * height, value)};
}

RgbImage random_image(int width, int height) {
  RgbImage image = grey_image(width, height, 0);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const float u = test::test_uniforms(3, static_cast<std::uint32_t>(i))[0];
    image.rgb[i] = 0.05f + 100 * std::pow(u, 8.0f);
  }
  return image;
}

RgbImage one_lit_texel(int width, int height, int i, int j) {
  RgbImage image = grey_image(width, height, 0);
  std::fill_n(image.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(j) * width + i), 3, 1000.0f);
  return image;
}

/// Integral over the columns [i0, i1) and rows [j0, j1) of constant texels, by channel.
std::array<double, 3> power(const RgbImage& image, int i0, int i1, int j0, int j1) {
  std::array<double, 3> sum{};
  for (int j = j0; j < j1; ++j) {
    const double rows =
        std::cos(kPiDouble * j / image.height) - std::cos(kPiDouble * (j + 1) / image.height);
    for (int i = i0; i < i1; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto texel = static_cast<std::size_t>(j) * image.width + i;
        sum[k] += image.rgb[3 * texel + k] * rows * 2 * kPiDouble / image.width;
      }
    }
  }
  return sum;
}

std::array<double, 3> power(const RgbImage& image) {
  return power(image, 0, image.width, 0, image.height);
}

void expect_equal(const std::array<double, 3>& got, const std::array<double, 3>& expected) {
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[k], expected[k], 1e-6 * expected[k]);
}

TEST(MapReduction, KeepsThePowerForAnySizes) {
  for (const int width : {63, 40, 32, 17, 5, 1}) {
    expect_equal(power(reduce_map(grey_image(64, 32, 0.7f), width, 1)),
                 power(grey_image(64, 32, 0.7f)));
    expect_equal(power(reduce_map(random_image(64, 32), width, 1)), power(random_image(64, 32)));
    expect_equal(power(reduce_map(random_image(67, 31), width, 1)), power(random_image(67, 31)));
    for (const int row : {0, 3, 15, 31}) {
      expect_equal(power(reduce_map(one_lit_texel(64, 32, 21, row), width, 1)),
                   power(one_lit_texel(64, 32, 21, row)));
    }
  }
}

TEST(MapReduction, KeepsThePowerOfEachBox) {
  const RgbImage map = random_image(64, 32);
  const RgbImage reduced = reduce_map(map, 16, 1);
  ASSERT_EQ(reduced.height, 8);
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < 16; ++i) {
      expect_equal(power(reduced, i, i + 1, j, j + 1),
                   power(map, 4 * i, 4 * i + 4, 4 * j, 4 * j + 4));
    }
  }
}

TEST(MapReduction, ATexelAcrossAnEdgeIsShared) {
  // Column 1 of three is [1/3, 2/3): half of it in either column of two.
  RgbImage map = grey_image(3, 1, 0);
  map.rgb[3] = 3;
  const RgbImage reduced = reduce_map(map, 2, 1);
  EXPECT_FLOAT_EQ(reduced.rgb[0], 1);
  EXPECT_FLOAT_EQ(reduced.rgb[3], 1);
}

TEST(MapReduction, RepairsBeforeItAverages) {
  RgbImage map = grey_image(12, 7, 1);
  map.rgb[0] = kNan;
  map.rgb[3 * 17 + 1] = -5;
  map.rgb[3 * 30 + 2] = kInfinity;
  map.rgb[3 * 45] = 2e38f;  // infinite when it is scaled
  RgbImage repaired = map;
  for (const std::size_t k : {0, 3 * 17 + 1, 3 * 30 + 2, 3 * 45}) repaired.rgb[k] = 0;
  // 3 rows: the map's lie across their edges.
  EXPECT_EQ(reduce_map(map, 5, 2).rgb, reduce_map(repaired, 5, 2).rgb);
}

}  // namespace
}  // namespace baton
