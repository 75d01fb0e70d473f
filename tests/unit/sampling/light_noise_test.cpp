#include "worker/sampling/light_noise.h"

#include <gtest/gtest.h>

#include <array>

namespace baton {
namespace {

using Memory = std::array<VisibilityCell, kVisibilityCells>;

TEST(LightNoise, IsUnknownAtFirst) {
  const Memory memory{};
  EXPECT_EQ(light_variance(memory), 0.0f);
  EXPECT_EQ(candidates_for_noise(100, light_variance(memory), 8192), 100);
}

TEST(LightNoise, IsAMeanThatForgets) {
  Memory memory{};
  remember_light_variance(memory, 0.5f);
  EXPECT_EQ(light_variance(memory), 0.5f) << "the first says it all";
  remember_light_variance(memory, 8.5f);
  EXPECT_EQ(light_variance(memory), 2.5f);
  for (int i = 0; i < 100; ++i) remember_light_variance(memory, 1e-3f);
  EXPECT_NEAR(light_variance(memory), 1e-3f, 2e-5f) << "to the eight bits that are kept";
  remember_light_variance(memory, 0);
  EXPECT_LT(light_variance(memory), 8e-4f);
}

TEST(LightNoise, LeavesWhatRaysFoundAlone) {
  Memory memory{};
  for (std::size_t bin = 0; bin < kVisibilityBins; ++bin) remember_ray(memory, bin, bin % 2 == 0);
  Memory before = memory;
  remember_light_variance(memory, 1);
  before[kLightNoise] = memory[kLightNoise];
  EXPECT_EQ(memory, before);
}

TEST(LightNoise, AsksForCandidates) {
  const float usual = 128 * kUsualNoise * kUsualNoise;  // one that leaves 128 the usual noise
  EXPECT_EQ(candidates_for_noise(128, usual, 8192), 128);
  EXPECT_EQ(candidates_for_noise(128, 16 * usual, 8192), 512) << "in proportion to noise";
  EXPECT_EQ(candidates_for_noise(128, usual / 100, 8192), 64);
  EXPECT_EQ(candidates_for_noise(16, 1e9f, 8192), 1024);
  EXPECT_EQ(candidates_for_noise(512, 1e9f, 8192), 8192) << "no more than there are";
  EXPECT_EQ(candidates_for_noise(101, usual, 8192) % 8, 0) << "whole vectors";
}

TEST(LightNoise, IsJudgedBesideItsSurroundings) {
  EXPECT_EQ(noise_scale(2, 0), 2.0f);
  EXPECT_GT(noise_scale(0, 1), noise_scale(0, 0.1f)) << "dark pixels may be noisier";
}

}  // namespace
}  // namespace baton
