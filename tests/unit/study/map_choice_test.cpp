#include "jobs/study/map_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/philox.h"
#include "jobs/study/map_pilot.h"
#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr int kSeeds = 8;
constexpr std::size_t kValues = 3000;

/// Differences of pictures of mean radiance 2: a fixed pattern of root mean square `pattern` that
/// is
/// +- alternately, an offset, and uniform noise of deviation `noise` that is each seed's own.
std::vector<std::vector<float>> differences(double pattern, double offset, double noise,
                                            std::uint64_t trial = 0) {
  std::vector<std::vector<float>> all;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    std::vector<float>& values = all.emplace_back();
    for (std::uint32_t i = 0; i < kValues; ++i) {
      const double u = uniform_float(Philox4x32::block({i, seed, 0, 0}, 77 + trial)[0]);
      const double value =
          offset + (i % 2 == 0 ? pattern : -pattern) + noise * std::sqrt(12.0) * (u - 0.5);
      values.push_back(static_cast<float>(2 * value));
    }
  }
  return all;
}

SystematicDifference seen(double pattern, double offset, double noise, std::uint64_t trial = 0) {
  return systematic_difference(differences(pattern, offset, noise, trial), 2);
}

TEST(MapChoice, TheDifferenceIsFreeOfNoise) {
  const SystematicDifference exact = seen(0.02, 0.01, 0);
  EXPECT_NEAR(exact.square, 0.02 * 0.02 + 0.01 * 0.01, 1e-8);
  EXPECT_NEAR(exact.square_error, 0, 1e-8);
  EXPECT_NEAR(exact.mean, 0.01, 1e-7);

  // Noise ten times as large, whose own square is 0.04.
  const SystematicDifference noisy = seen(0.02, 0.01, 0.2);
  EXPECT_NEAR(noisy.square, 0.0005, 4 * noisy.square_error);
  EXPECT_LT(noisy.square_error, 0.001);
  EXPECT_NEAR(noisy.mean, 0.01, 4 * noisy.mean_error);
  EXPECT_NEAR(noisy.mean_error, 0.2 / std::sqrt(kSeeds * kValues), 0.6 * noisy.mean_error);
}

// H0: the stated error is that of the square. 300 trials of pure noise, seeds 77...: the ratio of
// the mean stated variance to the variance seen lies in [0.8, 3]. The jackknife states up to twice
// the variance where nothing differs; an error that is wrong by a half is found.
TEST(MapChoice, TheErrorOfTheSquareIsNotUnderstated) {
  constexpr int kTrials = 300;
  double sum = 0, squares = 0, stated = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const SystematicDifference d = seen(0, 0, 0.2, static_cast<std::uint64_t>(trial));
    sum += d.square;
    squares += d.square * d.square;
    stated += d.square_error * d.square_error;
  }
  const double variance = squares / kTrials - sum / kTrials * (sum / kTrials);
  EXPECT_NEAR(sum / kTrials, 0, 4 * std::sqrt(variance / kTrials));
  EXPECT_GT(stated / kTrials, 0.8 * variance);
  EXPECT_LT(stated / kTrials, 3 * variance);
}

TEST(MapChoice, AllowsWhatTheErrorHides) {
  EXPECT_EQ(judge_map(seen(0.014, 0, 0.002), 0.1), MapVerdict::harmless);
  EXPECT_EQ(judge_map(seen(0.016, 0, 0.002), 0.1), MapVerdict::harmful);
  EXPECT_EQ(judge_map(seen(0.0002, 0, 0.2), 0.01), MapVerdict::open);
  EXPECT_EQ(judge_map({}, 0.1), MapVerdict::harmless);

  // A shift of all pixels by a resolved percent, though small beside the error.
  EXPECT_EQ(judge_map(seen(0, 0.01, 0.02), 0.1), MapVerdict::harmful);
  EXPECT_EQ(judge_map(seen(0, 0.0005, 0.002), 0.1), MapVerdict::harmless);
}

TEST(MapChoice, WidthsAreHalvedDownTo64) {
  EXPECT_THAT(coarser_widths(1024), ElementsAre(64, 128, 256, 512));
  EXPECT_THAT(coarser_widths(1000), ElementsAre(125, 250, 500));
  EXPECT_THAT(coarser_widths(127), IsEmpty());
}

TEST(MapChoice, FindsTheCoarsestByBisection) {
  const std::vector<int> widths = coarser_widths(8192);  // seven
  for (int first = 64; first <= 8192; first *= 2) {
    std::vector<int> tried;
    const auto found = coarsest_harmless(widths, [&](int width) -> Result<bool> {
      tried.push_back(width);
      return width >= first;
    });
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(found->value_or(8192), first);
    EXPECT_EQ(tried.front(), 64);
    EXPECT_LE(tried.size(), 4u);
  }
  EXPECT_FALSE(coarsest_harmless(widths, [](int) -> Result<bool> {
    return Error{ErrorKind::io, "gone"};
  }));
}

TEST(MapPilot, ComparesFramesOverTheWholeJob) {
  EXPECT_THAT(compared_frames({7}), ElementsAre(7));
  EXPECT_THAT(compared_frames({1, 2, 5}), ElementsAre(1, 2, 5));
  std::vector<int> frames;
  for (int frame = 1; frame <= 48; ++frame) frames.push_back(frame);
  const std::vector<int> compared = compared_frames(frames);
  EXPECT_EQ(compared.size(), 12u);
  EXPECT_EQ(compared.front(), 1);
  EXPECT_EQ(compared.back(), 48);
}

TEST(UnitCosts, LightIsPaidForTexelsThatAreNew) {
  JobSpec job;
  job.frames = {1, 2, 3, 4};
  job.environment.keys = {{1, "a.exr"}};
  const double still = counted_light_us(job, 1e6, 1e6);
  const double coarse = counted_light_us(job, 1e6, 1e4);
  job.environment.keys = {{1, "a.exr"}, {4, "b.exr"}};
  const double video = counted_light_us(job, 1e6, 1e6);
  const double coarse_video = counted_light_us(job, 1e6, 1e4);
  EXPECT_LT(coarse, still);
  EXPECT_GT(video - coarse_video, still - coarse);
}

}  // namespace
}  // namespace baton
