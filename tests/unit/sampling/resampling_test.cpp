#include "worker/sampling/resampling.h"
#include "tests/unit/sampling/systematic_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "worker/sampling/ess.h"

namespace baton {
namespace {

using testing::Each;
using testing::ElementsAre;

constexpr std::array kSchemes{ResamplingScheme::systematic, ResamplingScheme::stratified,
                              ResamplingScheme::multinomial, ResamplingScheme::residual};

TEST(Ess, CountsEqualWeights) {
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>(16, 0.25f)), 16);
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>{0, 3, 0}), 1);
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>{0, 0}), 0);
}

/// Offspring of a scheme under one seed.
std::vector<int> offspring(ResamplingScheme scheme, const std::vector<float>& weights,
                           std::uint64_t seed) {
  std::vector<std::int32_t> ancestors(16);
  resample(scheme, weights, ancestors, Rng({.job_seed = seed}, PassId::resample), 0);
  std::vector<int> counts(weights.size(), 0);
  for (const std::int32_t a : ancestors) ++counts[static_cast<std::size_t>(a)];
  return counts;
}

// Hypothesis: E[offspring_j] = N W_j. 4000 seeds, z-test per particle, two-sided level 1e-4 after
// Sidak over 32 tests
// (|z| < 4.6).
TEST(Resample, OffspringIsProportionalToWeight) {
  const std::vector<float> weights{0.05f, 0.3f, 0, 0.15f, 0.01f, 0.29f, 0.1f, 0.1f};
  constexpr int kRuns = 4000;
  for (const ResamplingScheme scheme : kSchemes) {
    std::vector<double> sum(weights.size()), squares(weights.size());
    for (int run = 0; run < kRuns; ++run) {
      const std::vector<int> counts =
          offspring(scheme, weights, static_cast<std::uint64_t>(run) + 1);
      for (std::size_t j = 0; j < counts.size(); ++j) {
        sum[j] += counts[j];
        squares[j] += counts[j] * counts[j];
      }
    }
    for (std::size_t j = 0; j < weights.size(); ++j) {
      const double mean = sum[j] / kRuns;
      const double error = std::sqrt((squares[j] / kRuns - mean * mean) / kRuns);
      EXPECT_NEAR(mean, 16 * double{weights[j]}, 4.6 * error + 1e-6)
          << "scheme " << static_cast<int>(scheme) << " " << j;
    }
  }
}

TEST(Resample, SystematicOffspringIsFloorOrCeiling) {
  const std::vector<float> weights{0.05f, 0.3f, 0, 0.15f, 0.01f, 0.29f, 0.1f, 0.1f};
  for (std::uint64_t seed = 1; seed < 200; ++seed) {
    const std::vector<int> counts = offspring(ResamplingScheme::systematic, weights, seed);
    for (std::size_t j = 0; j < counts.size(); ++j) {
      EXPECT_GE(counts[j], static_cast<int>(16 * weights[j]));
      EXPECT_LE(counts[j], static_cast<int>(16 * weights[j]) + 1);
    }
  }
}

TEST(Resample, OneLivingParticleGetsAll) {
  for (const ResamplingScheme scheme : kSchemes) {
    EXPECT_THAT(offspring(scheme, {0, 0, 1, 0}, 7), ElementsAre(0, 0, 16, 0));
  }
}

TEST(SystematicChoice, InvertsTheDistributionFunction) {
  std::vector<std::int32_t> chosen(4);
  systematic_choice(std::vector<float>{1, 1, 0, 2}, 0.5f, chosen);
  EXPECT_THAT(chosen, ElementsAre(0, 1, 3, 3));
}

TEST(SystematicChoice, RoundsTheExpectedNumberUpOrDown) {
  std::vector<float> weights(333);
  float total = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = static_cast<float>((i * 97) % 11);
    total += weights[i];
  }
  for (const std::size_t count : {1u, 16u, 64u}) {
    std::vector<double> mean(weights.size());
    constexpr int kOffsets = 1000;
    for (int k = 0; k < kOffsets; ++k) {
      std::vector<std::int32_t> chosen(count);
      systematic_choice(weights, (static_cast<float>(k) + 0.5f) / kOffsets, chosen);
      std::vector<int> offspring(weights.size());
      for (const std::int32_t i : chosen) ++offspring.at(static_cast<std::size_t>(i));
      for (std::size_t i = 0; i < weights.size(); ++i) {
        const double expected = static_cast<double>(count) * weights[i] / total;
        ASSERT_LE(std::abs(offspring[i] - expected), 1.001);
        mean[i] += static_cast<double>(offspring[i]) / kOffsets;
      }
    }
    // A regular grid of offsets measures every stretch to one part of the grid.
    for (std::size_t i = 0; i < weights.size(); ++i)
      EXPECT_NEAR(mean[i], static_cast<double>(count) * weights[i] / total, 2.5 / kOffsets);
  }
}

TEST(SystematicChoice, NeverTakesAZeroWeight) {
  std::vector<float> weights(40, 0.0f);
  weights[3] = 1e-20f;
  std::vector<std::int32_t> chosen(16);
  for (const float u : {0.0f, 0.37f, 0x1.fffffep-1f}) {
    systematic_choice(weights, u, chosen);
    EXPECT_THAT(chosen, Each(3));
  }
}

}  // namespace
}  // namespace baton
