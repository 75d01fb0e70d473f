#include "worker/sampling/resampling.h"

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

constexpr std::array kSchemes{ResamplingScheme::systematic, ResamplingScheme::stratified, ResamplingScheme::multinomial,
                              ResamplingScheme::residual};

TEST(Ess, CountsEqualWeights) {
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>(16, 0.25f)), 16);
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>{0, 3, 0}), 1);
  EXPECT_FLOAT_EQ(effective_sample_size(std::vector<float>{0, 0}), 0);
}

/// Offspring of a scheme under one seed.
std::vector<int> offspring(ResamplingScheme scheme, const std::vector<float>& weights, std::uint64_t seed) {
  std::vector<std::int32_t> ancestors(16);
  resample(scheme, weights, ancestors, Rng({.job_seed = seed}, PassId::resample), 0);
  std::vector<int> counts(weights.size(), 0);
  for (const std::int32_t a : ancestors) ++counts[static_cast<std::size_t>(a)];
  return counts;
}

// Hypothesis: E[offspring_j] = N W_j. 4000 seeds, z-test per particle, two-sided level 1e-4 after Sidak over 32 tests
// (|z| < 4.6).
TEST(Resample, OffspringIsProportionalToWeight) {
  const std::vector<float> weights{0.05f, 0.3f, 0, 0.15f, 0.01f, 0.29f, 0.1f, 0.1f};
  constexpr int kRuns = 4000;
  for (const ResamplingScheme scheme : kSchemes) {
    std::vector<double> sum(weights.size()), squares(weights.size());
    for (int run = 0; run < kRuns; ++run) {
      const std::vector<int> counts = offspring(scheme, weights, static_cast<std::uint64_t>(run) + 1);
      for (std::size_t j = 0; j < counts.size(); ++j) {
        sum[j] += counts[j];
        squares[j] += counts[j] * counts[j];
      }
    }
    for (std::size_t j = 0; j < weights.size(); ++j) {
      const double mean = sum[j] / kRuns;
      const double error = std::sqrt((squares[j] / kRuns - mean * mean) / kRuns);
      EXPECT_NEAR(mean, 16 * double{weights[j]}, 4.6 * error + 1e-6) << "scheme " << static_cast<int>(scheme) << " " << j;
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

std::vector<float> running_totals(const std::vector<float>& weights) {
  std::vector<float> totals;
  float total = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    total += weights[i];
    if (i % kChoiceBlock + 1 == kChoiceBlock || i + 1 == weights.size()) totals.push_back(total);
  }
  return totals;
}

TEST(SystematicChoice, InvertsTheDistributionFunction) {
  std::vector<std::int32_t> chosen(4);
  systematic_choice(std::vector<float>{1, 1, 0, 2}, std::vector<float>{4}, 0.5f, chosen);
  EXPECT_THAT(chosen, ElementsAre(0, 1, 3, 3));
}

TEST(SystematicChoice, AgreesWithResampleOverManyBlocks) {
  std::vector<float> weights(333);
  float total = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = static_cast<float>((i * 97) % 11);
    total += weights[i];
  }
  std::vector<std::int32_t> chosen(64);
  systematic_choice(weights, running_totals(weights), 0.37f, chosen);
  std::size_t j = 0;
  float before = 0;
  for (std::size_t m = 0; m < chosen.size(); ++m) {
    const float position = (static_cast<float>(m) + 0.37f) * total / 64;
    while (before + weights[j] <= position) before += weights[j++];
    EXPECT_EQ(chosen[m], static_cast<std::int32_t>(j));
  }
}

TEST(SystematicChoice, NeverTakesAZeroWeight) {
  std::vector<float> weights(40, 0.0f);
  weights[3] = 1e-20f;
  std::vector<std::int32_t> chosen(16);
  systematic_choice(weights, running_totals(weights), 0.999999f, chosen);
  EXPECT_THAT(chosen, Each(3));
  const std::vector<float> too_large{1e-20f, 1e-20f, 2e-20f};  // as rounding might make them
  systematic_choice(weights, too_large, 0.999999f, chosen);
  EXPECT_THAT(chosen, Each(3));
}

}  // namespace
}  // namespace baton
