// Sweeps: the sequence rendered several times, each frame the mean.
#include <gtest/gtest.h>

#include <cmath>

#include "common/image/noise.h"
#include "tests/support/render_tiled.h"
#include "worker/pass/sweep_mean.h"

namespace baton {
namespace {

using test::mean_rgb;
using test::render_tile;
using test::render_tiled;
using test::sequence_job;

JobSpec sweeps_job(Method method, int rounds, int sweeps) {
  JobSpec job = sequence_job(3);
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.quality = {.rounds = rounds, .sweeps = sweeps};
  job.output.aovs = {Aov::lns, Aov::normal, Aov::depth, Aov::variance, Aov::material};
  return job;
}

TEST(Sweeps, SameBytesForAnyTilingAndAnyRunLength) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::sequential}) {
    const JobSpec job = sweeps_job(method, 2, 3);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 2), whole) << static_cast<int>(method);
    EXPECT_EQ(render_tiled(job, 8, 1, test::keeping_nothing()), whole) << static_cast<int>(method);
  }
}

// From the last frame to the first the camera jumps; the sites of a sweep are its own.
TEST(Sweeps, SameBytesForAnyTilingWhileCameraAndObjectsMove) {
  for (const Method method : {Method::pool, Method::sequential}) {
    JobSpec job = sweeps_job(method, 2, 3);
    test::set_in_motion(job, true, true);
    job.camera.aperture = 0.1f;  // what is carried looks for its own point of the lens
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 1), whole) << static_cast<int>(method);
    EXPECT_EQ(render_tiled(job, 8, 2, test::keeping_nothing()), whole) << static_cast<int>(method);
  }
}

// Of a still all rounds are one chain, however it is cut into sweeps: the same samples, and a mean
// that differs by the rounding of floats.
TEST(Sweeps, OfAStillAreItsRounds) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::mis}) {
    JobSpec job = sweeps_job(method, 12, 1);
    job.frames = {FrameNumber(5)};
    const std::vector<double> at_once = mean_rgb(render_tile(job).films.back());
    job.quality = {.rounds = 4, .sweeps = 3};
    const std::vector<double> in_sweeps = mean_rgb(render_tiled(job, 4096, 1).back());
    ASSERT_EQ(at_once.size(), in_sweeps.size());
    for (std::size_t i = 0; i < at_once.size(); ++i)
      EXPECT_NEAR(in_sweeps[i], at_once[i], 2e-6 * std::max(1.0, at_once[i])) << "pixel " << i;
  }
}

FilmTile film_of(std::vector<std::string> channels, std::vector<float> values) {
  return {.rect = {4, 2, 6, 3}, .channels = std::move(channels), .values = std::move(values)};
}

/// A film of two pixels of one grey each.
FilmTile grey_film(float first, float second, float error) {
  return film_of({"R", "G", "B", "variance.G", "error"},
                 {first, second, first, second, first, second, 9, 9, error, error});
}

// Variance and error are the scatter of the sweeps over their number, whatever each of them said.
TEST(SweepMean, WeighsSweepsAlikeAndTellsTheirScatter) {
  FilmTile mean = grey_film(1, 2, kErrorUnknown);
  const std::vector<std::pair<float, float>> sweeps{{5, 2}, {3, 2}, {7, 10}};
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    FilmTile film = grey_film(sweeps[i].first, sweeps[i].second, i == 1 ? 0.3f : kErrorUnknown);
    ASSERT_TRUE(add_sweeps(std::move(mean), Sweep(static_cast<std::int32_t>(i) + 1), film));
    mean = std::move(film);
  }
  EXPECT_FLOAT_EQ(mean.values[0], 4);  // 1, 5, 3, 7
  EXPECT_FLOAT_EQ(mean.values[1], 4);  // 2, 2, 2, 10
  EXPECT_NEAR(mean.find("variance.G")[0], (9 + 1 + 1 + 9) / 3.0 / 4, 1e-5);
  EXPECT_NEAR(mean.find("variance.G")[1], (4 + 4 + 4 + 36) / 3.0 / 4, 1e-5);
  EXPECT_NEAR(mean.find("error")[0], (9 + 1 + 1 + 9) / 3.0 / 4, 1e-5);
  EXPECT_NEAR(mean.find("error")[1], (4 + 4 + 4 + 36) / 3.0 / 4, 1e-5);
}

TEST(SweepMean, APixelThatOneSweepSeesHasAnError) {
  const FilmTile earlier = grey_film(1, 1, kNoSurface);
  FilmTile film = grey_film(1, 3, kNoSurface);
  film.find("error")[1] = 0.5f;
  ASSERT_TRUE(add_sweeps(earlier, Sweep(1), film));
  EXPECT_EQ(film.find("error")[0], kNoSurface);
  EXPECT_FLOAT_EQ(film.find("error")[1], 1);
}

TEST(SweepMean, WhatIsCarriedFromSweepToSweepTellsNoError) {
  FilmTile earlier = film_of({"R", "variance.R"}, {1, 1, 0, 0});
  FilmTile film = film_of({"R", "variance.R"}, {3, 3, 0, 0});
  ASSERT_TRUE(add_sweeps(earlier, Sweep(1), film));
  EXPECT_EQ(film.find("variance.R")[0], 0);
}

TEST(SweepMean, LeavesOutWhatSeesNoSurface) {
  const std::vector<std::string> channels{"normal.X", "normal.Y", "normal.Z", "depth", "material"};
  const FilmTile earlier = film_of(channels, {0, 1, 0, 0, 0, 0, 0, 7, 0, 2});
  FilmTile film = film_of(channels, {0, 0, 1, 1, 0, 0, 4, 0, 3, 1});
  ASSERT_TRUE(add_sweeps(earlier, Sweep(1), film));
  EXPECT_EQ(film.values[6], 4) << "depth of the sweep that sees something";
  EXPECT_EQ(film.values[7], 7);
  EXPECT_EQ(film.values[8], 3) << "material";
  EXPECT_EQ(film.values[9], 2) << "the first one's";
  EXPECT_EQ(film.values[2], 1) << "unit normals";
  EXPECT_FLOAT_EQ(film.values[1], std::sqrt(.5f));
  EXPECT_FLOAT_EQ(film.values[3], std::sqrt(.5f));
}

TEST(SweepMean, RefusesAnotherTile) {
  FilmTile film = film_of({"R"}, {1, 2});
  FilmTile earlier = film;
  earlier.rect = {0, 0, 2, 1};
  const Status status = add_sweeps(earlier, Sweep(1), film);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message,
            "film of an earlier sweep: at 0,0 with channels R, expected 4,2, R");
}

}  // namespace
}  // namespace baton
