#include "common/job/plan/estimate.h"

#include <gtest/gtest.h>

#include <utility>

#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/math/pixel_blocks.h"

namespace baton {
namespace {

JobSpec small_job() {
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.frames = parse_frames("1-5").value();
  job.image = {.width = 100, .height = 50, .sites = 4, .tile_size = 32};
  job.state.checkpoint_every = 2;
  return job;
}

TEST(Estimate, CountsTasksAndWhatTheyWaitFor) {
  const JobEstimate e = estimate_job(small_job());
  EXPECT_EQ(e.tiles, 4 * 2);
  EXPECT_EQ(e.runs, 3);
  EXPECT_EQ(e.tasks(), 8 * 3 + 5);
  EXPECT_EQ(e.dependencies, 5 * 8 + 8 * 2);  // a frame on its tiles, a run on the one before
  EXPECT_EQ(e.primary_rays_per_pixel, 4);
  EXPECT_EQ(e.shadow_rays_per_pixel, 16);
}

TEST(Estimate, SizesStateOnlyWhereItIsCarried) {
  JobSpec job = small_job();
  EXPECT_EQ(estimate_job(job).state_bytes_per_pixel, 9 + 9 * 16);
  EXPECT_EQ(estimate_job(job).state_bytes, 153 * 5000);
  job.sampling.method = Method::pool;
  EXPECT_EQ(estimate_job(job).state_bytes_per_pixel, 9 + 12);
  EXPECT_EQ(estimate_job(job).state_bytes_per_block, 1024 + 64);
  EXPECT_EQ(
      estimate_job(job).state_bytes,
      21 * 5000 + 1088 * static_cast<std::int64_t>(PixelBlocks(job.image.rendered()).count()));
  job.sampling.method = Method::restir;
  EXPECT_EQ(estimate_job(job).state_bytes_per_pixel, 9 + 9 * 16 + 2);
  for (const Method method : {Method::bidirectional, Method::ratio}) {
    job.sampling.method = method;
    EXPECT_EQ(estimate_job(job).state_bytes, 0);
  }
  EXPECT_EQ(estimate_job(job).dependencies, 5 * 8);
}

// What a pixel has once for each of its populations.
TEST(Estimate, SizesBothPopulationsOfASecondPass) {
  JobSpec job = small_job();
  job.visibility.correlated = true;
  EXPECT_EQ(estimate_job(job).state_bytes_per_pixel, 2 * 9 + 9 * 16);
  job.visibility.mask = MaskPolicy::same_samples;
  EXPECT_EQ(estimate_job(job).state_bytes_per_pixel, 9 + 9 * 16);
}

// Pixels of `pool` choose the number of their rays.
TEST(Estimate, CountsTheMostRaysThatAPixelMayHave) {
  JobSpec job = small_job();
  job.sampling.method = Method::pool;
  for (const auto& [n, most] : {std::pair{1, 4}, {3, 12}, {5, 20}, {16, 64}, {17, 64}, {64, 64}}) {
    job.sampling.num_particles = n;
    EXPECT_EQ(estimate_job(job).shadow_rays_per_pixel, most) << n;
  }
  job.sampling.method = Method::reference;
  EXPECT_EQ(estimate_job(job).shadow_rays_per_pixel, 2 * job.sampling.reference_samples);
}

// Rounds have rays of their own; their sites, too, unless samples belong to them.
TEST(Estimate, CountsTheRaysOfAllRounds) {
  JobSpec job = small_job();
  job.quality.rounds = 3;
  EXPECT_EQ(estimate_job(job).primary_rays_per_pixel, 4);
  EXPECT_EQ(estimate_job(job).shadow_rays_per_pixel, 48);
  EXPECT_EQ(estimate_job(job).preroll_rounds, 0);
  job.sampling.method = Method::pool;
  EXPECT_EQ(estimate_job(job).primary_rays_per_pixel, 12);
  EXPECT_EQ(estimate_job(job).preroll_rounds, 4);
  job.state.carry = false;
  EXPECT_EQ(estimate_job(job).preroll_rounds, 0);
}

// A pixel that asks its neighbours needs the tiles around it, frame by frame.
TEST(Estimate, CountsTheTilesThatNeighborsLieIn) {
  JobSpec job = small_job();
  job.sampling.method = Method::restir;
  job.sampling.num_neighbors = 1;
  job.sampling.neighbor_radius = 32;
  EXPECT_EQ(estimate_job(job).runs, 5);
  EXPECT_EQ(estimate_job(job).dependencies, 5 * 8 + 4 * (2 * 2 * (2 + 3 + 3 + 2)));
  job.sampling.method = Method::sequential;
  EXPECT_EQ(estimate_job(job).runs, 3);
}

TEST(Estimate, AddsUpTheChannelsOfAFrame) {
  JobSpec job = small_job();
  job.output.aovs = {Aov::lns, Aov::source, Aov::normal};
  job.sampling.method = Method::bidirectional;
  const JobEstimate e = estimate_job(job);
  EXPECT_EQ(e.film_channels, 4 + 1 + 3 + 3 + 1);     // films also hold the error of probes
  EXPECT_EQ(e.frame_bytes, 5000 * (7 * 2 + 4 * 4));  // lns and normal stay float32

  // A second draw has rays.
  JobSpec drawn_twice = job;
  drawn_twice.output.aovs.push_back(Aov::variance);
  EXPECT_EQ(estimate_job(drawn_twice).shadow_rays_per_pixel, 2 * e.shadow_rays_per_pixel);
  EXPECT_EQ(estimate_job(drawn_twice).frame_bytes, e.frame_bytes + 5000 * 3 * 4);

  // Samples that are carried tell nothing of their error.
  job.sampling.method = Method::sequential;
  EXPECT_EQ(estimate_job(job).film_channels, e.film_channels - 1);
  EXPECT_EQ(estimate_job(job).frame_bytes, e.frame_bytes);
}

}  // namespace
}  // namespace baton
