#include "worker/integrator/light_pool.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace baton {
namespace {

/// A map with a gradient, so that every row of the table matters.
Environment gradient_environment() {
  RgbImage image{32, 16, {}};
  for (int i = 0; i < 32 * 16; ++i) {
    const auto value = static_cast<float>(1 + i / 32);
    image.rgb.insert(image.rgb.end(), {value, value, value});
  }
  return {std::make_shared<EnvironmentMap>(image, MapFilter::bilinear, 1.0f, false), Mat3{}};
}

// Hypothesis: whatever its place in a block, an entry is drawn from the whole table: the mean of y over the j-th entries of all
// blocks is that of the pool. 8 z-tests, |z| < 4. Without the shuffle the places differ by far more (each would see one
// eighth of the rows).
TEST(LightPool, EveryPlaceInABlockSeesTheWholeMap) {
  const Environment environment = gradient_environment();
  const LightPool pool = make_light_pool(environment, environment, 5, 1);
  std::array<double, LightPool::kBlock> mean{};
  double all = 0, squares = 0;
  for (const LightPool::Block& block : pool.blocks) {
    for (std::size_t j = 0; j < LightPool::kBlock; ++j) {
      mean[j] += double{block.y[j]} / static_cast<double>(pool.blocks.size());
      all += double{block.y[j]} / LightPool::kSize;
      squares += double{block.y[j]} * block.y[j] / LightPool::kSize;
    }
  }
  const double error = std::sqrt((squares - all * all) / static_cast<double>(pool.blocks.size()));
  for (std::size_t j = 0; j < LightPool::kBlock; ++j) EXPECT_NEAR(mean[j], all, 4 * error) << j;
}

TEST(LightPool, EntriesAgreeWithTheEnvironment) {
  const Environment environment = gradient_environment();
  const LightPool pool = make_light_pool(environment, environment, 5, 1);
  for (std::size_t b = 0; b < pool.blocks.size(); b += 97) {
    const LightPool::Block& block = pool.blocks[b];
    for (std::size_t j = 0; j < LightPool::kBlock; ++j) {
      const Vec3 w = decode_octahedral(block.code[j]);
      EXPECT_LT(length(w - Vec3{block.x[j], block.y[j], block.z[j]}), 1e-6f);
      EXPECT_NEAR(block.r[j], environment.evaluate(w).r, 1e-3f);
      EXPECT_EQ(block.r[j], block.before_r[j]);
      EXPECT_GT(block.density[j], 0);
    }
  }
}

/// Bright texels on dim ground, 1000 : 1, each with hard edges all around.
Environment hard_edged_environment() {
  constexpr int kWidth = 512, kHeight = 256;
  RgbImage image{kWidth, kHeight, {}};
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const float value = i % 7 == 0 ? 1000.0f : 1.0f;
    image.rgb.insert(image.rgb.end(), {value, value, value});
  }
  return {std::make_shared<EnvironmentMap>(image, MapFilter::nearest, 1.0f, false), Mat3{}};
}

// Hypothesis: rounding to the lattice leaves the density true: the mean of radiance / density over a pool is the map's
// power. Mean of 30 pools (seeds 1 to 30), z-test at |z| < 4; it sees a bias of 0.002 %. Without the margins of
// EnvironmentMap::sample light slips out of the bright texels, and the mean is too high by 400 times that.
TEST(LightPool, EstimatesThePowerOfHardEdgedMapsWithoutBias) {
  const Environment environment = hard_edged_environment();
  constexpr int kPools = 30;
  double sum = 0, squares = 0;
  for (int seed = 1; seed <= kPools; ++seed) {
    double mean = 0;
    for (const LightPool::Block& block : make_light_pool(environment, environment, seed, 1).blocks) {
      for (std::size_t j = 0; j < LightPool::kBlock; ++j)
        mean += double{block.r[j]} / block.density[j] / LightPool::kSize;
    }
    const double error = mean / environment.map->total_power() - 1;
    sum += error / kPools;
    squares += error * error / kPools;
  }
  const double interval = 4 * std::sqrt(std::max(squares - sum * sum, 0.0) / (kPools - 1)) + 2e-6;
  EXPECT_NEAR(sum, 0, interval);
}

TEST(LightPool, IsAFunctionOfSeedAndFrame) {
  const Environment environment = gradient_environment();
  const auto first_code = [&](std::uint64_t seed, std::uint32_t frame) {
    return make_light_pool(environment, environment, seed, frame).blocks[7].code[3];
  };
  EXPECT_EQ(first_code(5, 1), first_code(5, 1));
  EXPECT_NE(first_code(5, 1), first_code(5, 2));
  EXPECT_NE(first_code(5, 1), first_code(6, 1));
}

}  // namespace
}  // namespace baton
