#include "jobs/study/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "common/math/philox.h"

namespace baton {
namespace {

RgbImage flat(int width, int height, float r, float g, float b) {
  RgbImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i) image.rgb.insert(image.rgb.end(), {r, g, b});
  return image;
}

RgbImage noise(int width, int height, std::uint64_t seed) {
  RgbImage image = flat(width, height, 0, 0, 0);
  for (std::uint32_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = uniform_float(Philox4x32::block({i, 0, 0, 0}, seed)[0]);
  return image;
}

double mean_flip(const RgbImage& a, const RgbImage& b) {
  const std::vector<float> values = flip_difference(a, b);
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(Flip, EqualPicturesDoNotDiffer) {
  const RgbImage image = noise(23, 17, 1);
  for (const float value : flip_difference(image, image)) EXPECT_EQ(value, 0.0f);
}

// Uniform pictures have no features, so FLIP is the redistributed HyAB distance alone. By hand:
// black to white 100 in L; 100^0.7 = 25.119; the largest is green to blue, 41.2760; its knee
// 0.4 * 41.276 = 16.510; 0.95 + 0.05 * (25.119 - 16.510) / (41.276 - 16.510) = 0.96738.
TEST(Flip, BlackAgainstWhite) {
  const auto values = flip_difference(flat(9, 7, 0, 0, 0), flat(9, 7, 1, 1, 1));
  for (const float value : values) EXPECT_NEAR(value, 0.96738f, 1e-4f);
}

TEST(Flip, GreenAgainstBlueIsTheLargest) {
  const auto values = flip_difference(flat(9, 7, 0, 1, 0), flat(9, 7, 0, 0, 1));
  for (const float value : values) EXPECT_NEAR(value, 1.0f, 1e-4f);
}

TEST(Flip, LiesInTheUnitIntervalAndIsSymmetric) {
  const RgbImage a = noise(31, 19, 2), b = noise(31, 19, 3);
  const std::vector<float> forth = flip_difference(a, b);
  const std::vector<float> back = flip_difference(b, a);
  for (std::size_t i = 0; i < forth.size(); ++i) {
    EXPECT_GE(forth[i], 0.0f);
    EXPECT_LE(forth[i], 1.0f);
    EXPECT_EQ(forth[i], back[i]) << i;
  }
}

TEST(Flip, GrowsWithTheDifference) {
  const RgbImage grey = flat(16, 16, 0.2f, 0.2f, 0.2f);
  double last = 0;
  for (const float value : {0.22f, 0.3f, 0.5f, 1.0f}) {
    const double now = mean_flip(grey, flat(16, 16, value, value, value));
    EXPECT_GT(now, last);
    last = now;
  }
}

// The eye blurs: single pixels seen from afar vanish, the same light in a block does not.
TEST(Flip, FineNoiseCountsLessThanABlock) {
  const RgbImage grey = flat(64, 64, 0.2f, 0.2f, 0.2f);
  RgbImage checker = grey, block = grey;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const std::size_t at = 3 * static_cast<std::size_t>(y * 64 + x);
      const float fine = (x + y) % 2 == 0 ? 0.3f : 0.1f;
      const float coarse = x < 32 ? 0.3f : 0.1f;
      std::fill_n(checker.rgb.begin() + static_cast<std::ptrdiff_t>(at), 3, fine);
      std::fill_n(block.rgb.begin() + static_cast<std::ptrdiff_t>(at), 3, coarse);
    }
  }
  EXPECT_LT(mean_flip(grey, checker), 0.5 * mean_flip(grey, block));
}

TEST(Flip, ASinglePointIsSeenWhereItIs) {
  const RgbImage grey = flat(41, 41, 0.2f, 0.2f, 0.2f);
  RgbImage dot = grey;
  std::fill_n(dot.rgb.begin() + 3 * (20 * 41 + 20), 3, 1.0f);
  const std::vector<float> values = flip_difference(grey, dot);
  const auto largest = std::max_element(values.begin(), values.end()) - values.begin();
  EXPECT_EQ(largest, 20 * 41 + 20);
  EXPECT_EQ(values.front(), 0.0f);
}

}  // namespace
}  // namespace baton
