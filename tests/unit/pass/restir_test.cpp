// What `restir` hands from frame to frame and from pixel to pixel.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/state/sample_planes.h"
#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::render_tile;
using test::render_tiled;

/// Alone or with neighbours, with all samples or free ones only.
JobSpec restir_job(int neighbors, bool reuse_visibility) {
  JobSpec job = test::sequence_job(5);
  job.sampling.method = Method::restir;
  job.sampling.num_candidates = 32;
  job.sampling.num_neighbors = neighbors;
  job.sampling.neighbor_radius = 5;
  job.sampling.reuse_visibility = reuse_visibility;
  return job;
}

TEST(Restir, SameBytesForAnyTilingAndAnyRunLength) {
  for (const bool reuse_visibility : {false, true}) {
    const JobSpec job = restir_job(0, reuse_visibility);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
    EXPECT_EQ(render_tiled(job, 8, 5), whole);
    EXPECT_EQ(render_tiled(job, 5, 2), whole);
    EXPECT_EQ(render_tiled(job, 4096, 1), whole);
  }
}

TEST(Restir, SameBytesForAnyTilingWithNeighbors) {
  for (const bool moving : {false, true}) {
    JobSpec job = restir_job(2, moving);
    if (moving) test::set_in_motion(job, true, true);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
    EXPECT_EQ(render_tiled(job, 8, 2), whole);
    EXPECT_EQ(render_tiled(job, 3, 1), whole);
    job.sampling.num_neighbors = 1;
    EXPECT_NE(render_tiled(job, 4096, 5), whole);
  }
}

// Forgetting says nothing of the frame in which the ray was blocked.
TEST(Restir, FreeSamplesAloneAreCarriedOn) {
  JobSpec job = restir_job(0, true);
  const test::TileResult lit = render_tile(job);
  job.sampling.reuse_visibility = false;
  const test::TileResult all = render_tile(job);
  EXPECT_EQ(lit.films[0], all.films[0]);
  EXPECT_NE(lit.films[1], all.films[1]);
  std::size_t forgotten = 0;
  const auto lit_weight = ConstSamplePlanes(lit.state).weight;
  const auto all_weight = ConstSamplePlanes(all.state).weight;
  for (std::size_t j = 0; j < lit_weight.size(); ++j)
    forgotten += lit_weight[j] == 0 && all_weight[j] > 0 ? 1 : 0;
  EXPECT_GT(forgotten, 0u);
  EXPECT_EQ(*decode_state(encode_state(lit.state), "test"), lit.state);
}

TEST(Restir, ConfidenceGrowsByAFrameUpToTheLimit) {
  JobSpec job = restir_job(0, false);
  job.sampling.history_limit = 3;
  for (const int frames : {1, 2, 5}) {
    job.frames = test::frame_numbers(frames);
    const SampleState state = render_tile(job).state;
    for (std::size_t i = 0; i < state.num_pixels(); ++i) {
      const bool seen = state.source[i] != PixelSource::background;
      EXPECT_EQ(confidence_plane(state)[i], seen ? std::min(frames, 3) : 0);
    }
  }
}

}  // namespace
}  // namespace baton
