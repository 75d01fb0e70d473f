#include "worker/sampling/light_noise.h"

#include <gtest/gtest.h>

#include <array>

namespace baton {
namespace {

using Memory = std::array<VisibilityCell, kVisibilityCells>;

TEST(LightNoise, IsUnknownAtFirst) {
  const Memory memory{};
  EXPECT_EQ(light_variance(memory).from_light, 0.0f);
  EXPECT_EQ(light_variance(memory).from_lobes, 0.0f);
  EXPECT_EQ(candidates_for_noise(100, 0, kNeedOfLight, 8192), 100);
}

TEST(LightNoise, IsAMeanThatForgets) {
  Memory memory{};
  remember_light_variance(memory, {0.5f, 0});
  EXPECT_EQ(light_variance(memory).from_light, 0.5f) << "the first says it all";
  remember_light_variance(memory, {8.5f, 3});
  EXPECT_EQ(light_variance(memory).from_light, 2.5f);
  EXPECT_EQ(light_variance(memory).from_lobes, 3.0f) << "each kind by itself";
  for (int i = 0; i < 100; ++i) remember_light_variance(memory, {1e-3f, 3});
  EXPECT_NEAR(light_variance(memory).from_light, 1e-3f, 2e-5f) << "to the eight bits that are kept";
  remember_light_variance(memory, {0, 3});
  EXPECT_LT(light_variance(memory).from_light, 8e-4f);
  EXPECT_EQ(light_variance(memory).from_lobes, 3.0f);
}

TEST(LightNoise, LeavesWhatRaysFoundAlone) {
  Memory memory{};
  for (std::size_t bin = 0; bin < kVisibilityBins; ++bin) remember_ray(memory, bin, bin % 2 == 0);
  Memory before = memory;
  remember_light_variance(memory, {1, 2});
  before[kLightNoise] = memory[kLightNoise];
  before[kLobeNoise] = memory[kLobeNoise];
  EXPECT_EQ(memory, before);
}

TEST(LightNoise, AsksForCandidates) {
  const float usual = 128 * kNeedOfLight.usual_noise *
                      kNeedOfLight.usual_noise;  // one that leaves 128 the usual noise
  const auto wanted = [](std::int32_t usual_count, float variance) {
    return candidates_for_noise(usual_count, variance, kNeedOfLight, 8192);
  };
  EXPECT_EQ(wanted(128, usual), 128);
  EXPECT_EQ(wanted(128, 16 * usual), 512) << "in proportion to noise";
  EXPECT_EQ(wanted(128, usual / 100), 32);
  EXPECT_EQ(candidates_for_noise(32, usual / 1e6f, kNeedOfLobes, 8192), 32);
  EXPECT_EQ(wanted(16, 1e9f), 1024);
  EXPECT_EQ(wanted(512, 1e9f), 8192) << "no more than there are";
  EXPECT_EQ(wanted(101, usual) % 8, 0) << "whole vectors";
}

TEST(LightNoise, IsJudgedBesideItsSurroundings) {
  EXPECT_EQ(noise_scale(2, 0), 2.0f);
  EXPECT_GT(noise_scale(0, 1), noise_scale(0, 0.1f)) << "dark pixels may be noisier";
}

}  // namespace
}  // namespace baton
