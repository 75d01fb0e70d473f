#include "worker/sampling/light_noise.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

constexpr PoolTuning kTuning;

void remember(PixelMemory& memory, const LightVariance& seen) {
  remember_light_variance(kTuning, seen, memory);
}
std::int32_t of_light(std::int32_t usual_number, float variance) {
  return candidates_for_noise(kTuning, kTuning.light, usual_number, variance, 8192);
}

TEST(LightNoise, IsUnknownAtFirst) {
  const PixelMemory memory;
  EXPECT_EQ(light_variance(memory).from_light, 0.0f);
  EXPECT_EQ(light_variance(memory).from_lobes, 0.0f);
  EXPECT_EQ(of_light(100, 0), 100);
}

TEST(LightNoise, IsAMeanThatForgets) {
  PixelMemory memory;
  remember(memory, {0.5f, 0});
  EXPECT_EQ(light_variance(memory).from_light, 0.5f) << "the first says it all";
  remember(memory, {8.5f, 3});
  EXPECT_EQ(light_variance(memory).from_light, 2.5f);
  EXPECT_EQ(light_variance(memory).from_lobes, 3.0f) << "each kind by itself";
  for (int i = 0; i < 100; ++i) remember(memory, {1e-3f, 3});
  EXPECT_NEAR(light_variance(memory).from_light, 1e-3f, 2e-5f) << "to the eight bits that are kept";
  remember(memory, {0, 3});
  EXPECT_LT(light_variance(memory).from_light, 8e-4f);
  EXPECT_EQ(light_variance(memory).from_lobes, 3.0f);
}

TEST(LightNoise, AsksForCandidates) {
  const float usual_noise = kTuning.light.usual_noise;
  const float usual = 128 * usual_noise * usual_noise;  // one that leaves 128 the usual noise
  EXPECT_EQ(of_light(128, usual), 128);
  EXPECT_EQ(of_light(128, 16 * usual), 512) << "in proportion to noise";
  EXPECT_EQ(of_light(128, usual / 100), 32);
  EXPECT_EQ(candidates_for_noise(kTuning, kTuning.lobes, 32, usual / 1e6f, 8192), 32);
  EXPECT_EQ(of_light(16, 1e9f), 1024);
  EXPECT_EQ(of_light(512, 1e9f), 8192) << "no more than there are";
  EXPECT_EQ(of_light(101, usual) % 8, 0) << "whole vectors";
}

TEST(LightNoise, IsJudgedBesideItsSurroundings) {
  EXPECT_EQ(noise_scale(kTuning, 2, 0), 2.0f);
  EXPECT_GT(noise_scale(kTuning, 0, 1), noise_scale(kTuning, 0, 0.1f))
      << "dark pixels may be noisier";
}

}  // namespace
}  // namespace baton
