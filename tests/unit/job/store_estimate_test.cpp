#include "common/job/plan/store_estimate.h"

#include <gtest/gtest.h>

#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

JobSpec job_of(Method method, int frames) {
  JobSpec job;
  job.sampling.method = method;
  job.frames.clear();
  for (int frame = 1; frame <= frames; ++frame) job.frames.emplace_back(frame);
  job.image = {.width = 640, .height = 360, .sites = 4, .tile_size = 64};
  job.state.checkpoint_every = 12;
  job.environment.keys = {{.frame = 1, .map = "sky.exr"}};
  job.environment.rotation_deg_per_frame = 1;
  return job;
}

JobSpec moving(JobSpec job) {
  job.camera.keys = {{.frame = 1, .position = {0, 0, 5}, .look_at = {}, .up = {0, 1, 0}}};
  job.motion.max_px = 8;
  return job;
}

// Two checkpoints stay at rest, where each tile lets its own go; in motion the third is complete
// before one goes.
TEST(StoreEstimate, CountsTheCheckpointsThatAreThereTogether) {
  const std::int64_t one = estimate_store(job_of(Method::sequential, 12), 1).states;
  EXPECT_EQ(one, estimate_job(job_of(Method::sequential, 12)).state_bytes);
  EXPECT_EQ(estimate_store(job_of(Method::sequential, 24), 1).states, one);
  EXPECT_EQ(estimate_store(job_of(Method::sequential, 30), 1).states, 2 * one);
  EXPECT_EQ(estimate_store(job_of(Method::sequential, 480), 1).states, 2 * one);
  EXPECT_EQ(estimate_store(moving(job_of(Method::sequential, 12)), 1).states, one);
  EXPECT_EQ(estimate_store(moving(job_of(Method::sequential, 24)), 1).states, 2 * one);
  EXPECT_EQ(estimate_store(moving(job_of(Method::sequential, 480)), 1).states, 3 * one);
  JobSpec all = job_of(Method::sequential, 30);
  all.state.keep = StateKeep::all;
  EXPECT_EQ(estimate_store(all, 1).states, 3 * one);
  EXPECT_EQ(estimate_store(moving(all), 1).states, 30 * one) << "each frame's";
  EXPECT_EQ(estimate_store(job_of(Method::bidirectional, 30), 1).states, 0);
}

// While the light stands still, weights are alike and pack to nothing.
TEST(StoreEstimate, SaysWhatWeightsTake) {
  JobSpec job = job_of(Method::sequential, 12);
  const std::int64_t turning = estimate_store(job, 1).states;
  job.environment.rotation_deg_per_frame = 0;
  EXPECT_EQ(turning - estimate_store(job, 1).states, 640 * 360 * 4 * 16);
  job.sampling.start_method = Method::mis;
  EXPECT_EQ(estimate_store(job, 1).states, turning);
}

// Skies have no states, but colours.
TEST(StoreEstimate, CountsThePixelsThatSeeASurface) {
  JobSpec job = job_of(Method::sequential, 30);
  const StoreEstimate whole = estimate_store(job, 1), half = estimate_store(job, 0.5);
  EXPECT_NEAR(static_cast<double>(half.states), 0.5 * static_cast<double>(whole.states), 2);
  EXPECT_EQ(half.films, whole.films) << "no AOV";
  job.output.aovs = {Aov::depth};
  EXPECT_LT(estimate_store(job, 0.5).films, estimate_store(job, 1).films);
  job.output.aovs.clear();
  job.output.background = Background::transparent;
  EXPECT_LT(estimate_store(job, 0.5).films, half.films);
}

TEST(StoreEstimate, MemoriesGrowWithTheFramesUntilAllBinsAreKnown) {
  const auto states = [](int frames) {
    return estimate_store(job_of(Method::pool, frames), 1).states;
  };
  EXPECT_GT(states(12), states(2));
  EXPECT_LT(states(3000), states(300) + states(300) / 50);
  EXPECT_LT(states(3000), bound_store(job_of(Method::pool, 3000)).states);
}

// As measured on the demo (320 x 180 pixels, tiles of 64, of 57600 pixels 39,600 with a surface):
// within a tenth.
TEST(StoreEstimate, IsThatOfTheDemo) {
  const struct {
    int num_particles, frames;
    double measured_bytes;
  } rows[] = {{64, 2, 1139237}, {64, 12, 1326244}, {16, 2, 1038647}, {16, 12, 1256933}};
  for (const auto& row : rows) {
    JobSpec job = job_of(Method::pool, row.frames);
    job.image.width = 320;
    job.image.height = 180;
    job.sampling.num_particles = row.num_particles;
    job.state.checkpoint_every = 1000;
    const auto states = static_cast<double>(estimate_store(job, 39600.0 / 57600).states);
    EXPECT_NEAR(states / row.measured_bytes, 1, 0.1) << row.num_particles << " " << row.frames;
  }
}

// All that is likely is possible.
TEST(StoreEstimate, IsWithinItsBound) {
  for (const Method method : {Method::pool, Method::sequential, Method::bidirectional}) {
    for (const int frames : {1, 5, 12, 13, 24, 48, 200}) {
      for (const bool moves : {false, true}) {
        for (const bool second : {false, true}) {
          JobSpec job = job_of(method, frames);
          if (moves) job = moving(job);
          job.visibility.correlated = second;
          const StoreEstimate likely = estimate_store(job, 1), most = bound_store(job);
          EXPECT_LE(likely.states, most.states) << frames;
          EXPECT_LE(likely.films, most.films) << frames;
          EXPECT_LE(likely.samples, most.samples) << frames;
          EXPECT_EQ(likely.samples > 0, second);
        }
      }
    }
  }
}

TEST(StoreEstimate, ABlobIsThatOfATile) {
  JobSpec job = job_of(Method::sequential, 12);
  EXPECT_EQ(estimate_blob_bytes(job, BlobKind::state), 64 * 64 * 153);
  EXPECT_EQ(estimate_blob_bytes(job, BlobKind::image), 0);
  job.image.tile_size = 61;
  EXPECT_EQ(estimate_blob_bytes(job, BlobKind::state), 64 * 64 * 153) << "tiles are whole blocks";
  job.image.tile_size = 1024;
  EXPECT_EQ(estimate_blob_bytes(job, BlobKind::state), 640 * 360 * 153);
}

}  // namespace
}  // namespace baton
