// Light between surfaces: the bytes that tiles must not change, and what stands beside the picture.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::channel;
using test::render_tiled;

/// box_job in four blocks of 8 x 8 pixels and parts of more, with matt and glossy surfaces.
JobSpec bounce_job(Method method) {
  JobSpec job = test::sequence_job(2);
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.image.width = 21;
  job.image.height = 19;
  job.light.bounces = 2;
  job.output.aovs = {Aov::variance, Aov::direct, Aov::indirect};
  return job;
}

TEST(Bounces, SameBytesForAnyTilingAndAnyRunLength) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::sequential}) {
    for (const int rounds : {1, 3}) {
      SCOPED_TRACE(rounds);
      JobSpec job = bounce_job(method);
      job.quality.rounds = rounds;
      const std::vector<FilmTile> whole = render_tiled(job, 4096, 2);
      EXPECT_EQ(render_tiled(job, 8, 1), whole) << static_cast<int>(method);
      EXPECT_EQ(render_tiled(job, 16, 2, test::keeping_nothing()), whole)
          << static_cast<int>(method);
    }
  }
}

TEST(Bounces, SameBytesForAnyTilingWithFineSitesAndAdaptiveRounds) {
  JobSpec job = bounce_job(Method::pool);
  job.image.max_sites = 64;
  job.quality.rounds = 5;
  job.quality.adaptive_threshold = 0.05f;
  EXPECT_EQ(render_tiled(job, 8, 2), render_tiled(job, 4096, 2));
}

TEST(Bounces, SameBytesForAnyTilingWhileCameraAndObjectsMove) {
  JobSpec job = bounce_job(Method::pool);
  test::set_in_motion(job, true, true);
  EXPECT_EQ(render_tiled(job, 8, 1), render_tiled(job, 4096, 1));
}

TEST(Bounces, ThePictureIsItsParts) {
  const JobSpec job = bounce_job(Method::pool);
  const FilmTile film = test::render_tile(job).films.back();
  JobSpec without = job;
  without.light.bounces = 0;
  const FilmTile direct = test::render_tile(without).films.back();
  double added = 0;
  for (const char* const c : {"R", "G", "B"}) {
    const auto whole = channel(film, c), indirect = channel(film, std::string("indirect.") + c),
               rest = channel(film, std::string("direct.") + c), alone = channel(direct, c);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_GE(indirect[i], -1e-3f * whole[i]);
      EXPECT_NEAR(rest[i] + indirect[i], whole[i], 1e-5f * std::fabs(whole[i]));
      EXPECT_NEAR(rest[i], alone[i], 1e-5f * std::fabs(alone[i])) << "direct light stays as it is";
      added += double{indirect[i]};
    }
  }
  EXPECT_GT(added, 0);
}

/// Sum of the luminance of a colour.
double sum_of(const FilmTile& film, const std::string& color) {
  double sum = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i)
    sum += double{luminance({channel(film, color + ".R")[i], channel(film, color + ".G")[i],
                             channel(film, color + ".B")[i]})};
  return sum;
}

// What `render` says that it adds is what frames have, rounds before the first one left out.
TEST(Bounces, WhatItAddsIsCounted) {
  for (const int preroll : {0, 4}) {
    JobSpec job = bounce_job(Method::pool);
    job.output.background = Background::transparent;
    job.state.preroll = preroll;
    const auto render = test::render_tile(job);
    double direct = 0, indirect = 0;
    for (const FilmTile& film : render.films) {
      direct += sum_of(film, "direct");
      indirect += sum_of(film, "indirect");
    }
    EXPECT_GT(indirect, 0);
    EXPECT_NEAR(render.stats.light.indirect, indirect, 1e-4 * indirect) << preroll;
    EXPECT_NEAR(render.stats.light.direct, direct, 1e-4 * direct) << preroll;
  }
}

}  // namespace
}  // namespace baton
