#include <gtest/gtest.h>

#include "tests/support/small_scene.h"

namespace baton {
namespace {

JobSpec still_job(int frames) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(frames);
  job.sampling.refresh_every = 0;
  return job;
}

TEST(StillLight, SamplesAreKeptAsTheyAre) {
  const test::TileResult result = test::render_tile(still_job(9));
  EXPECT_EQ(result.stats.sampling.independent_proposed + result.stats.sampling.local_proposed, 0u);
  EXPECT_GT(result.stats.sampling.pixels_carried, 0u);
  const std::vector<double> first = test::mean_rgb(result.films.front());
  const std::vector<double> last = test::mean_rgb(result.films.back());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(last[i], first[i], 1e-5 * first[i]);
}

TEST(StillLight, ATurnStartsAfreshAllTheSame) {
  JobSpec job = still_job(5);
  job.sampling.refresh_every = 4;
  const RenderStats stats = test::render_tile(job).stats;
  EXPECT_EQ(stats.sampling.pixels_refreshed, stats.sampling.pixels_fresh);
}

TEST(StillLight, WhatMovesIsMovedOn) {
  // Light that turns.
  JobSpec job = still_job(3);
  job.environment.rotation_deg_per_frame = 0.5;
  EXPECT_GT(test::render_tile(job).stats.sampling.independent_proposed, 0u);

  // Surfaces that are others than before, but not those that stand still.
  job = still_job(3);
  const RenderStats all = test::render_tile(job).stats;
  test::set_in_motion(job, /*camera=*/false, /*object=*/true);
  const RenderStats some = test::render_tile(job).stats;
  const std::uint64_t per_pixel = static_cast<std::uint64_t>(job.sampling.num_particles) *
                                  static_cast<std::uint64_t>(job.sampling.num_distributions);
  EXPECT_GT(some.sampling.independent_proposed + some.sampling.local_proposed, 0u);
  EXPECT_LT(some.sampling.independent_proposed + some.sampling.local_proposed,
            per_pixel * (all.pixels - all.pixels_background) / 3);
}

}  // namespace
}  // namespace baton
