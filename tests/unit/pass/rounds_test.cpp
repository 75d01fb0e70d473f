// Rounds of a frame, and rounds before the first one.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "common/job/text/frame_range.h"
#include "tests/support/render_tiled.h"
#include "worker/pass/primary.h"
#include "worker/pass/round_mean.h"

namespace baton {
namespace {

using test::channel;
using test::mean_rgb;
using test::render_tile;
using test::render_tiled;
using test::sequence_job;

JobSpec rounds_job(Method method, int rounds) {
  JobSpec job = sequence_job(3);
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.quality.rounds = rounds;
  job.output.aovs = {Aov::lns, Aov::visibility, Aov::normal, Aov::depth, Aov::variance, Aov::mask};
  return job;
}

TEST(Rounds, SameBytesForAnyTilingAndAnyRunLength) {
  for (const Method method :
       {Method::pool, Method::bidirectional, Method::sequential, Method::restir}) {
    const JobSpec job = rounds_job(method, 3);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 2), whole) << static_cast<int>(method);
    EXPECT_EQ(render_tiled(job, 8, 1, test::keeping_nothing()), whole) << static_cast<int>(method);
  }
}

TEST(Rounds, SameBytesForAnyTilingWhileCameraAndObjectsMove) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::sequential}) {
    JobSpec job = rounds_job(method, 3);
    job.image.filter = PixelFilter::gaussian;
    test::set_in_motion(job, true, true);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 1), whole) << static_cast<int>(method);
    EXPECT_EQ(render_tiled(job, 8, 2, test::keeping_nothing()), whole) << static_cast<int>(method);
  }
}

// Tiles of more sites than caches hold the surfaces of (kSitesInCache) are rendered in parts.
TEST(Rounds, OfLargeTilesHaveTheSameBytes) {
  for (const Method method : {Method::pool, Method::bidirectional}) {
    for (const int max_sites : {0, 64}) {
      JobSpec job = rounds_job(method, 2);
      job.image.width = 48;
      job.image.height = 32;
      job.image.max_sites = max_sites;
      for (const bool in_motion : {false, true}) {
        if (in_motion) test::set_in_motion(job, true, true);
        const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
        const std::string what =
            std::to_string(static_cast<int>(method)) + ", " + std::to_string(max_sites);
        EXPECT_EQ(render_tiled(job, 16, 1), whole) << what;
        EXPECT_EQ(render_tiled(job, 4096, 1, test::keeping_nothing()), whole) << what;
      }
    }
  }
}

/// RMSE beside a mean of many rounds, over mean radiance.
double error_of(const JobSpec& job, const std::vector<double>& truth) {
  constexpr int kSeeds = 6;
  double squares = 0, light = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    JobSpec run = job;
    run.seed = static_cast<std::uint64_t>(seed);
    const std::vector<double> pixels = mean_rgb(render_tile(run).films.back());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      squares += (pixels[i] - truth[i]) * (pixels[i] - truth[i]) / kSeeds;
      light += truth[i] / kSeeds;
    }
  }
  const auto n = static_cast<double>(truth.size());
  return std::sqrt(squares / n) / (light / n);
}

// Four rounds have half the error of one, and sixteen a quarter, or less: rounds are other samples
// at other sites. Where a round repeated another, or its sites did, the error would stay.
TEST(Rounds, ErrorFallsWithTheirNumber) {
  for (const Method method : {Method::bidirectional, Method::pool, Method::mis, Method::ratio}) {
    JobSpec job = rounds_job(method, 1);
    job.frames = {FrameNumber(1)};
    JobSpec reference = job;
    reference.sampling.method = Method::reference;
    reference.sampling.reference_samples = 64;
    reference.quality.rounds = 600;
    reference.seed = 77;
    const std::vector<double> truth = mean_rgb(render_tile(reference).films.back());
    std::array<double, 3> error{};
    for (const int rounds : {1, 4, 16}) {
      job.quality.rounds = rounds;
      error[static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(rounds)) / 2)] =
          error_of(job, truth);
    }
    std::printf("  %s: %.4f, %.4f, %.4f of the mean with 1, 4, 16 rounds\n",
                std::string(traits(method).name).c_str(), error[0], error[1], error[2]);
    EXPECT_LT(error[1], 0.62 * error[0]) << static_cast<int>(method);
    EXPECT_LT(error[2], 0.36 * error[0]) << static_cast<int>(method);
  }
}

// A round starts from what those before have learnt; so does the next frame.
TEST(Rounds, APixelsMemoryGoesFromRoundToRound) {
  JobSpec job = rounds_job(Method::pool, 3);
  job.frames = parse_frames("1-2").value();
  job.state.preroll = 0;
  const SamplingStats did = render_tile(job).stats.sampling;
  EXPECT_GT(did.pixels_fresh, 0u);
  EXPECT_GT(did.pixels_carried, 4 * did.pixels_fresh) << "five rounds of six";
  job.state.carry = false;
  EXPECT_EQ(render_tile(job).stats.sampling.pixels_carried, 0u);
}

// Unseen rounds leave a memory, so that the first frame has about the error of a later one; they
// are those of the frame that is first, and methods without a memory have none.
TEST(Preroll, MakesTheFirstFrameLikeALaterOne) {
  JobSpec job = rounds_job(Method::pool, 1);
  job.environment.rotation_deg_per_frame = 0;
  job.image.sites = 1;
  job.sampling.num_candidates = 64;
  const auto variance_of = [&](int frames, int preroll) {
    job.frames = test::frame_numbers(frames);
    job.state.preroll = preroll;
    double sum = 0;
    for (int seed = 1; seed <= 20; ++seed) {
      job.seed = static_cast<std::uint64_t>(seed);
      const auto output = render_tile(job);
      for (const double v : mean_rgb(output.films.back(), "variance")) sum += v;
    }
    return sum;
  };
  const double without = variance_of(1, 0), with = variance_of(1, 4), later = variance_of(5, 0);
  std::printf("  variance of frame 1: %.3g, with four unseen rounds %.3g; of frame 5 %.3g\n",
              without, with, later);
  EXPECT_LT(with, 0.8 * without);
  EXPECT_LT(with, 1.4 * later);
}

TEST(Preroll, IsForMethodsWithAMemory) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::sequential}) {
    JobSpec job = rounds_job(method, 2);
    job.state.preroll = 0;
    const test::TileResult none = render_tile(job);
    job.state.preroll = 2;
    const test::TileResult two = render_tile(job);
    EXPECT_EQ(none.films == two.films, method != Method::pool) << static_cast<int>(method);
    EXPECT_EQ(none.stats.rays_primary, two.stats.rays_primary);
    EXPECT_EQ(none.stats.pixels, two.stats.pixels);
    EXPECT_EQ(none.stats.sampling.pixels(), two.stats.sampling.pixels());
  }
}

/// The mean of pixel results, one a round.
FilmTile mean_of(Method method, const std::vector<PixelResult>& rounds) {
  JobSpec job;
  job.sampling.method = method;
  job.quality.rounds = static_cast<int>(rounds.size());
  job.output.aovs = {Aov::lns,      Aov::visibility, Aov::source,   Aov::normal,     Aov::depth,
                     Aov::variance, Aov::mask,       Aov::material, Aov::unshadowed, Aov::blocked};
  RoundMean mean(job, {0, 0, 1, 1});
  for (const PixelResult& pixel : rounds) mean.add(0, pixel);
  return mean.finish();
}

TEST(RoundMean, EveryAovHasItsMeaning) {
  PixelResult bright{.radiance = {4, 4, 4},
                     .coverage = 1,
                     .alpha = 1,
                     .lns = 6,
                     .visibility = 0.5f,
                     .source_color = {0, 1, 0},
                     .normal = {0, 1, 0},
                     .depth = 2,
                     .mask = 1,
                     .material = 3,
                     .blocked = {1, 2, 3},
                     .error = 100};
  PixelResult half = bright;
  half.radiance = {1, 1, 1};
  half.coverage = half.alpha = 0.5f;
  half.lns = 2;
  half.visibility = 1;
  half.normal = {1, 0, 0};
  half.depth = 5;
  half.mask = 0;
  half.material = 4;
  const PixelResult nothing{.radiance = {1, 1, 1}};
  const FilmTile film = mean_of(Method::pool, {nothing, bright, half});
  const auto value = [&](const char* name) { return channel(film, name)[0]; };
  EXPECT_FLOAT_EQ(value("R"), 2);
  EXPECT_FLOAT_EQ(value("A"), 0.5f);
  EXPECT_FLOAT_EQ(value("lns"), 8.0f / 3);
  EXPECT_FLOAT_EQ(value("visibility"), 5.0f / 8) << "3 + 2 of 6 + 2";
  EXPECT_FLOAT_EQ(value("depth"), 3) << "by the sites that see a surface";
  EXPECT_FLOAT_EQ(value("normal.X"), 1 / std::sqrt(5.0f));
  EXPECT_FLOAT_EQ(value("normal.Y"), 2 / std::sqrt(5.0f));
  EXPECT_FLOAT_EQ(value("mask"), 0.5f) << "of two rounds";
  EXPECT_FLOAT_EQ(value("source.G"), 1);
  EXPECT_EQ(value("material"), 3) << "of the first that sees one";
  EXPECT_FLOAT_EQ(value("variance.G"), 1.5f * 1.5f * 2 / 9) << "1, and 2.5 of the other two";
  EXPECT_FLOAT_EQ(value("blocked.B"), 6.0f / 3);
  EXPECT_FLOAT_EQ(value("unshadowed.B"), 4);
  EXPECT_FLOAT_EQ(value(kErrorChannel), value("variance.G")) << "grey";
  EXPECT_EQ(channel(mean_of(Method::pool, {nothing, nothing}), kErrorChannel)[0], kNoSurface);
  EXPECT_FLOAT_EQ(channel(mean_of(Method::pool, {nothing, nothing}), "mask")[0], 0.5f);
}

TEST(RoundMean, ARoundAloneIsAsItWas) {
  const PixelResult pixel{.radiance = {0.1f, 0.7f, 0.3f},
                          .coverage = 1,
                          .alpha = 1,
                          .lns = 0.7f,
                          .visibility = 0.3f,
                          .variance = {0.1f, 0.2f, 0.3f}};
  const FilmTile film = mean_of(Method::sequential, {pixel});
  EXPECT_EQ(channel(film, "G")[0], 0.7f);
  EXPECT_EQ(channel(film, "visibility")[0], 0.3f);
  EXPECT_EQ(channel(film, "variance.B")[0], 0.3f);
}

TEST(RoundMean, VarianceIsTheDistanceOfTheHalves) {
  std::vector<PixelResult> rounds(4);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = static_cast<float>(i);
    rounds[i] = {.radiance = {value, 2 * value, 5}, .coverage = 1, .variance = {100, 100, 100}};
  }
  // 0.5 and 2.5: a quarter of the square of their distance.
  const FilmTile film = mean_of(Method::bidirectional, rounds);
  EXPECT_FLOAT_EQ(channel(film, "variance.R")[0], 1);
  EXPECT_FLOAT_EQ(channel(film, "variance.G")[0], 4);
  EXPECT_EQ(channel(film, "variance.B")[0], 0);
  EXPECT_FLOAT_EQ(channel(film, kErrorChannel)[0], 1) << "of grey";
  EXPECT_EQ(channel(mean_of(Method::sequential, rounds), "variance.R")[0], 0) << "rounds correlate";
}

// 18 rounds: two that count once, then two that count eight times.
TEST(RoundMean, RoundsHaveWeights) {
  JobSpec job;
  job.sampling.method = Method::bidirectional;
  job.quality.rounds = 18;
  job.quality.adaptive_threshold = 1;
  job.output.aovs = {Aov::depth, Aov::variance, Aov::rounds, Aov::blocked};
  RoundMean mean(job, {0, 0, 1, 1});
  const std::array<float, 4> values{1, 3, 4, 6};
  for (std::size_t i = 0; i < 4; ++i) {
    PixelResult pixel{.radiance = {values[i], values[i], values[i]}};
    pixel.coverage = pixel.alpha = i == 3 ? 1.0f : 0.0f;
    pixel.depth = 7;
    pixel.blocked = {1, values[i], 1};
    mean.add(0, pixel, i < 2 ? 1 : 8);
    // Of two: variance 2, mean 2.
    if (i == 1) {
      EXPECT_NEAR(mean.squared_noise(0), cycles_noise_squared(2.0 / 18, 2), 1e-12);
    }
  }
  const FilmTile film = mean.finish();
  const auto value = [&](const char* name) { return channel(film, name)[0]; };
  EXPECT_FLOAT_EQ(value("R"), (1 + 3 + 8 * 4 + 8 * 6) / 18.0f);
  EXPECT_FLOAT_EQ(value("A"), 8 / 18.0f);
  EXPECT_FLOAT_EQ(value("depth"), 7);
  EXPECT_EQ(value("rounds"), 4);
  EXPECT_FLOAT_EQ(value("blocked.G"), value("R"));
  // Both pairs have the variance 2, their means half of it, and weigh 2 and 16 of 18.
  EXPECT_FLOAT_EQ(value("variance.R"), (4 + 256) / 324.0f);
  EXPECT_FLOAT_EQ(value(kErrorChannel), (4 + 256) / 324.0f);
}

// Of 10 rounds one after those that judge: its distance from their mean, 6, is all that is known.
TEST(RoundMean, ASingleLaterRoundHasAVariance) {
  JobSpec job;
  job.sampling.method = Method::bidirectional;
  job.quality.rounds = 10;
  job.quality.adaptive_threshold = 1;
  job.output.aovs = {Aov::variance};
  RoundMean mean(job, {0, 0, 1, 1});
  for (const float value : {1.0f, 3.0f, 8.0f})
    mean.add(0, {.radiance = {value, value, value}}, value < 8 ? 1 : 8);
  EXPECT_FLOAT_EQ(channel(mean.finish(), "variance.R")[0], 0.2f * 0.2f * 1 + 0.8f * 0.8f * 24);
}

}  // namespace
}  // namespace baton
