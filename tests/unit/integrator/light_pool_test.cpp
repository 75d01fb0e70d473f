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
