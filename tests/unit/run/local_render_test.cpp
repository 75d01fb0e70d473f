#include "worker/run/local_render.h"

#include <gtest/gtest.h>

#include "tests/support/small_scene.h"

namespace baton {
namespace {

/// The images of a job, by frame.
std::vector<FilmTile> images(const JobSpec& job, int threads) {
  std::vector<FilmTile> films(job.frames.size());
  const auto context = load_render_context(job, Digest{1, 2});
  EXPECT_TRUE(context.ok());
  const FrameSink sink = [&](std::int32_t frame, const FilmTile& film) {
    films[static_cast<std::size_t>(frame)] = film;
    return Status();
  };
  EXPECT_TRUE(render_locally(**context, job, threads, sink).ok());
  return films;
}

// Samples follow moving surfaces, then pixels exchange them: two reaches into other tiles.
TEST(LocalRender, TilingsDoNotShowInTheSecondPassOfWhatMoves) {
  JobSpec job = test::box_job();
  job.image = {.width = 21, .height = 17, .sites = 4, .tile_size = 4096};
  job.sampling.method = Method::sequential;
  job.frames = test::frame_numbers(3);
  job.visibility = {.correlated = true, .dilate = 1};
  job.output.aovs = {Aov::source, Aov::mask};
  test::set_in_motion(job, true, true);
  const std::vector<FilmTile> whole = images(job, 1);
  job.image.tile_size = 8;
  EXPECT_EQ(images(job, 2), whole);
}

}  // namespace
}  // namespace baton
