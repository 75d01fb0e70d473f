// Rounds for the pixels that need them.
#include "worker/pass/adaptive_rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::channel;
using test::render_tile;
using test::render_tiled;

JobSpec adaptive_job(Method method, float threshold) {
  JobSpec job = test::sequence_job(3);
  job.image.width = 27;  // blocks and tiles of which a part is outside
  job.image.height = 21;
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.quality.rounds = 8;
  job.quality.adaptive_threshold = threshold;
  job.output.aovs = {Aov::normal, Aov::depth,  Aov::variance,     Aov::rounds,
                     Aov::albedo, Aov::motion, Aov::crypto_object};
  return job;
}

double mean_rounds(const FilmTile& film) {
  const auto rounds = channel(film, "rounds");
  return std::accumulate(rounds.begin(), rounds.end(), 0.0) / static_cast<double>(rounds.size());
}

constexpr float kThreshold = 0.04f;

TEST(AdaptiveRounds, SameBytesForAnyTilingAndAnyRunLength) {
  for (const Method method : {Method::pool, Method::bidirectional}) {
    for (const bool in_motion : {false, true}) {
      JobSpec job = adaptive_job(method, kThreshold);
      if (in_motion) test::set_in_motion(job, true, true);
      const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
      EXPECT_EQ(render_tiled(job, 8, 2), whole) << static_cast<int>(method) << in_motion;
      EXPECT_EQ(render_tiled(job, 16, 1, test::keeping_nothing()), whole)
          << static_cast<int>(method) << in_motion;
      const double rounds = mean_rounds(whole.back());
      EXPECT_GT(rounds, 3.2) << "or it would test nothing";
      EXPECT_LT(rounds, 7.8);
    }
  }
}

TEST(AdaptiveRounds, NoiseThatNobodyReachesTakesAllRounds) {
  for (const bool with_catcher : {false, true}) {
    JobSpec job = adaptive_job(Method::pool, 1e-9f);
    std::erase(job.output.aovs, Aov::variance);
    if (with_catcher) {
      job.scene.ground->catcher = true;
      job.output.background = Background::transparent;
    }
    // But for the error, which is told of two parts apart.
    const auto picture = [](const JobSpec& of) {
      FilmTile film = render_tile(of).films.back();
      std::fill_n(film.find(kErrorChannel), film.num_pixels(), kErrorUnknown);
      return film;
    };
    const FilmTile adaptive = picture(job);
    job.quality.adaptive_threshold.reset();
    EXPECT_EQ(picture(job), adaptive) << with_catcher;
  }
}

TEST(AdaptiveRounds, CleanBlocksGetThree) {
  const JobSpec job = adaptive_job(Method::pool, 1e6f);
  const FilmTile film = render_tile(job).films.back();
  for (const float rounds : channel(film, "rounds")) EXPECT_EQ(rounds, 3);
}

// A picture of shadows alone, all of whose pixels are black.
TEST(AdaptiveRounds, ShadowsOnAPlateCount) {
  JobSpec job = adaptive_job(Method::pool, 0.01f);
  job.camera.look_at = {0, 0, 1.8f};
  job.camera.vertical_fov_deg = 8;
  job.scene.ground->catcher = true;
  job.output.background = Background::transparent;
  const FilmTile film = render_tile(job).films.back();
  const auto rounds = channel(film, "rounds"), alpha = channel(film, "A");
  EXPECT_EQ(*std::max_element(alpha.begin(), alpha.end()), 0);
  EXPECT_GT(*std::max_element(rounds.begin(), rounds.end()), 3);
}

/// A film of one block that got `values` in the judging rounds.
RoundMean judged(const JobSpec& job, float first, float second) {
  RoundMean film(job, {0, 0, 8, 8});
  for (const float value : {first, second}) {
    for (std::size_t i = 0; i < 64; ++i) film.add(i, {.radiance = {value, value, value}});
  }
  return film;
}

TEST(AdaptiveRounds, RoundsAreInProportionToTheNoise) {
  JobSpec job;
  job.quality.rounds = 18;
  // Variance 0.02 of a round, grey 1.
  const double noise = std::sqrt(cycles_noise_squared(0.02 / 18, 1));
  const auto rounds_at = [&](double threshold) {
    job.quality.adaptive_threshold = static_cast<float>(threshold);
    AdaptiveRounds adaptive(job, {0, 0, 8, 8});
    adaptive.judge(judged(job, 0.9f, 1.1f));
    std::int32_t rounds = 0;
    double weight = 0;
    for (Round round; round < Round(18); ++round) {
      const RoundPixels pixels = adaptive.pixels(round);
      EXPECT_TRUE(pixels.size() == 0 || pixels.size() == 64);
      if (pixels.size() == 0) continue;
      ++rounds;
      weight += pixels.weight(63);
    }
    EXPECT_NEAR(weight, 18, 1e-9) << "no light is lost";
    return rounds;
  };
  EXPECT_EQ(rounds_at(noise / 2), 18);
  EXPECT_EQ(rounds_at(2.01 * noise), 2 + 8);
  EXPECT_EQ(rounds_at(4.01 * noise), 2 + 4);
  EXPECT_EQ(rounds_at(1e3 * noise), 2 + 1);
}

}  // namespace
}  // namespace baton
