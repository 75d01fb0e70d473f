// The ways to carry Lns, on a small exact space where everything is known: the ratio form through
// many frames, and the bias of the path sums against J / (2 P).
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/unit/sampling/discrete_target.h"

namespace baton::HWY_NAMESPACE {
namespace {

const PointValues kDawn{1, 2, 3, 4, 5, 6, 2, 1};
const PointValues kDusk{2, 1.6f, 2.4f, 3, 6, 4, 2.6f, 1.5f};

/// Exact mean of log p_n / p_(n-1) under p^k, k = beta P.
double mean_log_ratio(const DiscreteTarget& target, double beta) {
  double sum = 0;
  double total = 0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double p = std::pow(target.before[i], 1 - beta) * std::pow(target.now[i], beta);
    total += p;
    sum += p * std::log(target.now[i] / target.before[i]);
  }
  return sum / total;
}

/// Exact value of the sum that a rule takes over P distributions.
double exact_sum(const DiscreteTarget& target, LnsUpdate rule, int distributions) {
  PathSum sum(rule, distributions);
  for (int k = 0; k <= distributions; ++k) {
    sum.Add(k, {mean_log_ratio(target, static_cast<double>(k) / distributions), 1.0});
  }
  return sum.log_ratio();
}

double exact_log_ratio(const DiscreteTarget& target) {
  return std::log(double{sum_of(target.now)} / double{sum_of(target.before)});
}

/// J: the two Kullback-Leibler divergences together, which is what the integrand grows by from k =
/// 0 to P.
double symmetrised_divergence(const DiscreteTarget& target) {
  return mean_log_ratio(target, 1) - mean_log_ratio(target, 0);
}

SequentialSettings settings_of(LnsUpdate update, int distributions, int particles, int moves) {
  return {.num_particles = particles,
          .num_distributions = distributions,
          .num_moves = moves,
          .lns_update = update,
          .local_move_fraction = 0};
}

// ---- the rules themselves -----------------------------------------------------------------------

TEST(PathSum, LeftAndRightMissByHalfTheDivergenceOverP) {
  const DiscreteTarget change(kDawn, kDusk);
  const double truth = exact_log_ratio(change);
  for (const int p : {5, 10, 40}) {
    const double expected = symmetrised_divergence(change) / (2 * p);
    EXPECT_NEAR(exact_sum(change, LnsUpdate::path_left, p) - truth, -expected, 0.2 * expected / p);
    EXPECT_NEAR(exact_sum(change, LnsUpdate::path_right, p) - truth, expected, 0.2 * expected / p);
  }
}

TEST(PathSum, TheTrapezoidsErrorFallsWithTheSquareOfP) {
  const DiscreteTarget change({1, 2, 3, 4, 5, 6, 2, 1}, {6, 1, 2, 2, 7, 1, 4, 3});
  const double truth = exact_log_ratio(change);
  const double at_5 = exact_sum(change, LnsUpdate::path_trapezoid, 5) - truth;
  const double at_10 = exact_sum(change, LnsUpdate::path_trapezoid, 10) - truth;
  EXPECT_NEAR(at_5 / at_10, 4, 0.2);
}

// ---- the sampler --------------------------------------------------------------------------------

// Hypothesis: the mean of log Lns^_n / Lns_(n-1) is the exact sum of its rule. 20000 runs of 64
// particles, seeds 1 ..., 6 comparisons at a level of 1e-3 together (Sidak): |z| < 3.77. The means
// under p^k come from self-normalised weights, whose own bias is O(1 / N): it may take 2 % of J /
// (2 P).
TEST(PathSampling, MeanIsTheSumOfTheRule) {
  const DiscreteTarget change(kDawn, kDusk);
  const double divergence = symmetrised_divergence(change);
  for (const int p : {2, 5}) {
    for (const LnsUpdate rule :
         {LnsUpdate::path_left, LnsUpdate::path_right, LnsUpdate::path_trapezoid}) {
      Moments logs;
      for (std::uint64_t run = 1; run <= 20000; ++run) {
        Particles particles(kDawn, 64, run);
        const SequentialOutcome outcome =
            step(change, settings_of(rule, p, 64, 1), run, particles, sum_of(kDawn));
        logs.add(std::log(double{outcome.lns} / double{sum_of(kDawn)}));
      }
      const double allowed = 3.77 * logs.error() + 0.02 * divergence / (2 * p);
      EXPECT_NEAR(logs.mean(), exact_sum(change, rule, p), allowed) << "P " << p;
      std::printf("  P %d rule %d: bias %+.5f +- %.5f of log Lns, J / 2P = %.5f\n", p,
                  static_cast<int>(rule), logs.mean() - exact_log_ratio(change), logs.error(),
                  divergence / (2 * p));
    }
  }
}

/// Lns^_n / Lns_n at frames 1, 5, 20 while the target swings between two shapes, over `runs` seeds.
struct SwingResult {
  Moments at_1, at_5, at_20;
};
SwingResult swing(SequentialSettings settings, int runs) {
  const DiscreteTarget there(kDawn, kDusk);
  const DiscreteTarget back(kDusk, kDawn);
  settings.num_particles = 64;
  SwingResult result;
  for (int run = 1; run <= runs; ++run) {
    Particles particles(kDawn, 64, static_cast<std::uint64_t>(run));
    float lns = sum_of(kDawn);
    for (std::uint32_t frame = 1; frame <= 20; ++frame) {
      const bool odd = frame % 2 == 1;
      lns =
          step(odd ? there : back, settings, static_cast<std::uint64_t>(run), particles, lns, frame)
              .lns;
      const double ratio = lns / sum_of(odd ? kDusk : kDawn);
      if (frame == 1) result.at_1.add(ratio);
      if (frame == 5) result.at_5.add(ratio);
      if (frame == 20) result.at_20.add(ratio);
    }
  }
  return result;
}

/// Sidak for 24 comparisons at a level of 1e-3 together.
constexpr double kLimit = 4.10;

// Hypothesis: E[Lns^_n] = Lns_n at frames 1, 5 and 20, for every scheme, for one distribution with
// five moves and for five with one. Resampling at every frame whose weights differ. 4000 runs; the
// smallest bias that would be seen is kLimit standard errors.
TEST(RatioForm, IsUnbiasedThroughTwentyFramesWithEveryScheme) {
  double coarsest = 0;
  for (const auto scheme : {ResamplingScheme::systematic, ResamplingScheme::stratified,
                            ResamplingScheme::multinomial, ResamplingScheme::residual}) {
    for (const auto& [distributions, moves] : {std::pair(1, 5), std::pair(5, 1)}) {
      SequentialSettings settings = settings_of(LnsUpdate::ratio, distributions, 64, moves);
      settings.ess_ratio_min = 1;
      settings.resampling = scheme;
      const SwingResult result = swing(settings, 4000);
      for (const Moments* at : {&result.at_1, &result.at_5, &result.at_20}) {
        EXPECT_NEAR(at->mean(), 1, kLimit * at->error())
            << "P " << distributions << " scheme " << static_cast<int>(scheme);
        coarsest = std::max(coarsest, kLimit * at->error());
      }
    }
  }
  EXPECT_LT(coarsest, 0.01);
  std::printf("  the smallest bias that would have been seen: %.2f %%\n", 100 * coarsest);
}

// The bias of a left sum with P = 1 must be seen by the test that the ratio form passes.
TEST(PathSampling, ALeftSumCompoundsUntilItIsSeen) {
  const SwingResult result = swing(settings_of(LnsUpdate::path_left, 1, 64, 5), 1000);
  EXPECT_LT(result.at_20.mean(), 1 - kLimit * result.at_20.error());
}

// ---- supports that change -----------------------------------------------------------------------

// Half of the points go dark: the path runs within what is left, and the lost share leaves Lns at
// once.
TEST(PathSampling, TheLostShareLeavesLns) {
  const DiscreteTarget half(kDawn, {0, 0, 0, 0, 5, 6, 2, 1});
  Moments lns;
  for (std::uint64_t run = 1; run <= 2000; ++run) {
    Particles particles(kDawn, 64, run);
    const SequentialOutcome outcome =
        step(half, settings_of(LnsUpdate::path_trapezoid, 5, 64, 1), run, particles, sum_of(kDawn));
    ASSERT_TRUE(outcome.alive);
    lns.add(outcome.lns);
  }
  EXPECT_NEAR(lns.mean(), 14, 4 * lns.error());
}

// Light where there was none is not on the path and must not break it.
TEST(PathSampling, NewLightIsLeftOutAndNothingIsNan) {
  const DiscreteTarget lit({0, 0, 0, 0, 5, 6, 2, 1}, kDawn);
  for (std::uint64_t run = 1; run <= 200; ++run) {
    Particles particles(lit.before, 16, run);
    const SequentialOutcome outcome =
        step(lit, settings_of(LnsUpdate::path_right, 3, 16, 2), run, particles, sum_of(lit.before));
    ASSERT_TRUE(outcome.alive);
    EXPECT_NEAR(outcome.lns, 14, 1e-3f);
  }
}

}  // namespace
}  // namespace baton::HWY_NAMESPACE
