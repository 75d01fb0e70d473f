// The sequential sampler on a small exact space: eight points with given targets. "Directions" are
// indices.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sampling/discrete_target.h"

namespace baton::HWY_NAMESPACE {
namespace {

SequentialOutcome step(const DiscreteTarget& target, const SequentialSettings& settings,
                       std::uint64_t seed, Particles& p) {
  return step(target, settings, seed, p, sum_of(target.before));
}

const DiscreteTarget kChange{{1, 2, 3, 4, 5, 6, 2, 1}, {6, 1, 2, 2, 7, 1, 4, 3}};
SequentialSettings settings_of(int distributions,
                               ResamplingScheme scheme = ResamplingScheme::systematic) {
  return {.num_particles = 16,
          .num_distributions = distributions,
          .ess_ratio_min = 1.0f,
          .resampling = scheme,
          .local_move_fraction = 0};
}

/// Lns^ * (1 + fault), or the estimate of point 0's mass, over `runs` seeds.
Moments repeat(const SequentialSettings& settings, int runs, bool of_point, double lns_fault = 0) {
  Moments moments;
  for (int run = 1; run <= runs; ++run) {
    Particles p(kChange.before, 16, static_cast<std::uint64_t>(run));
    const SequentialOutcome outcome = step(kChange, settings, static_cast<std::uint64_t>(run), p);
    double value = outcome.lns * (1 + lns_fault);
    if (of_point) {
      value = 0;
      for (std::size_t i = 0; i < p.code.size(); ++i)
        value += p.code[i] == 0 ? outcome.lns * p.weight[i] : 0;
    }
    moments.add(value);
  }
  return moments;
}

// Hypothesis: E[Lns^_n] = Lns_n exactly, for each P and scheme. 20000 runs, |z| < 4.4 (level 1e-5
// each); the smallest bias that would be seen is 4.4 standard errors, below 0.7 %.
TEST(SequentialStep, NormalisingConstantIsUnbiased) {
  const double truth = sum_of(kChange.now);
  for (const int distributions : {1, 2, 5}) {
    for (const auto scheme : {ResamplingScheme::systematic, ResamplingScheme::multinomial,
                              ResamplingScheme::residual, ResamplingScheme::stratified}) {
      const Moments m = repeat(settings_of(distributions, scheme), 20000, false);
      EXPECT_NEAR(m.mean(), truth, 4.4 * m.error()) << "P " << distributions;
      EXPECT_LT(4.4 * m.error(), 0.011 * truth);
    }
  }
}

// Hypothesis: E[sum_j u_j 1(w_j = point 0)] = p~_n(point 0): the set is properly weighted after
// moves and resampling.
TEST(SequentialStep, SetIsProperlyWeighted) {
  for (const int distributions : {1, 5}) {
    const Moments m = repeat(settings_of(distributions), 20000, true);
    EXPECT_NEAR(m.mean(), kChange.now[0], 4.4 * m.error()) << "P " << distributions;
  }
}

TEST(SequentialStep, MovesAreCountedByKind) {
  Particles p(kChange.before, 16, 1);
  SequentialSettings settings = settings_of(2);
  settings.num_moves = 3;
  const SequentialOutcome outcome = step(kChange, settings, 1, p);
  EXPECT_EQ(outcome.local.proposed, 0);
  EXPECT_EQ(outcome.independent.proposed, 2 * 3 * 16);
  EXPECT_GT(outcome.independent.accepted, 0);
  EXPECT_LE(outcome.independent.accepted, outcome.independent.proposed);
}

TEST(SequentialStep, PlantedFaultIsSeen) {
  const Moments m = repeat(settings_of(5), 20000, false, 0.02);
  EXPECT_GT(std::fabs(m.mean() - sum_of(kChange.now)), 4.4 * m.error());
}

TEST(SequentialStep, NothingChangesWhenNothingChanges) {
  const DiscreteTarget still{kChange.before, kChange.before};
  Particles p(still.before, 16, 1);
  const SequentialOutcome outcome = step(still, settings_of(5), 1, p);
  EXPECT_TRUE(outcome.alive);
  EXPECT_FLOAT_EQ(outcome.lns, sum_of(still.before));
  EXPECT_FALSE(outcome.resampled);
  EXPECT_FLOAT_EQ(outcome.ess, 16);
}

TEST(SequentialStep, DiesWhenAllTargetsVanish) {
  const DiscreteTarget dark{kChange.before, {}};
  Particles p(dark.before, 16, 1);
  EXPECT_FALSE(step(dark, settings_of(1), 1, p).alive);
  Particles q(dark.before, 16, 1);
  EXPECT_FALSE(step(dark, settings_of(5), 1, q).alive);
}

TEST(SequentialStep, DeadParticlesWeighNothing) {
  // Half of the points go dark: their particles must not contribute, and nothing is NaN.
  const DiscreteTarget half{kChange.before, {0, 0, 0, 0, 5, 6, 2, 1}};
  SequentialSettings settings = settings_of(1);
  settings.ess_ratio_min = 0;
  Particles p(half.before, 16, 3);
  const std::vector<OctDirection> old = p.code;
  const SequentialOutcome outcome = step(half, settings, 3, p);
  ASSERT_TRUE(outcome.alive);
  float total = 0;
  for (std::size_t i = 0; i < old.size(); ++i) {
    EXPECT_EQ(p.weight[i] == 0, old[i] < 4) << i;
    total += p.weight[i];
  }
  EXPECT_NEAR(total, 1, 1e-5f);
}

TEST(SequentialStep, HugeChangesStayFinite) {
  const DiscreteTarget flash{{1e-20f, 1e-20f, 1e-20f, 1e-20f, 1e-20f, 1e-20f, 1e-20f, 1e-20f},
                             {1e20f, 1e15f, 1e20f, 1, 1e20f, 1e20f, 1e10f, 1e20f}};
  Particles p(flash.before, 16, 5);
  const SequentialOutcome outcome = step(flash, settings_of(5), 5, p);
  if (outcome.alive) {
    EXPECT_TRUE(std::isfinite(outcome.lns));
    for (const float w : p.weight) EXPECT_TRUE(std::isfinite(w));
  }
}

}  // namespace
}  // namespace baton::HWY_NAMESPACE
