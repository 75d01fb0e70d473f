#include "worker/run/local_render.h"

#include <gtest/gtest.h>

#include "tests/support/local_frames.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

/// The images of a job, by frame.
std::vector<FilmTile> images(const JobSpec& job) {
  std::vector<FilmTile> films(job.frames.size());
  const auto context = load_render_context(job, Digest{1, 2});
  EXPECT_TRUE(context.ok());
  const test::FrameSink sink = [&](Step step, const FilmTile& film) {
    films[step.index()] = film;
    return Status();
  };
  EXPECT_TRUE(test::render_locally(**context, sink).ok());
  return films;
}

/// Samples follow moving surfaces, then pixels exchange them: two reaches into other tiles.
void expect_no_tiling_in_the_second_pass_of_what_moves(const ImageSpec& image) {
  JobSpec job = test::box_job();
  job.image = image;
  job.image.tile_size = 4096;
  job.sampling.method = Method::sequential;
  job.frames = test::frame_numbers(3);
  job.visibility = {.correlated = true, .dilate = 1};
  job.output.aovs = {Aov::source, Aov::mask};
  test::set_in_motion(job, true, true);
  const std::vector<FilmTile> whole = images(job);
  job.image.tile_size = 8;
  EXPECT_EQ(images(job), whole);
}

TEST(LocalRender, TilingsDoNotShowInTheSecondPassOfWhatMoves) {
  expect_no_tiling_in_the_second_pass_of_what_moves({.width = 21, .height = 17, .sites = 4});
}

/// The pixels of `rect` of an image that begins at (0, 0).
FilmTile cut(const FilmTile& image, const PixelRect& rect) {
  FilmTile part{.rect = rect, .channels = image.channels, .values = {}};
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
      const float* const row = image.plane(c) + std::ptrdiff_t{y} * image.rect.width();
      part.values.insert(part.values.end(), row + rect.x0, row + rect.x1);
    }
  }
  return part;
}

// While pixels take nothing from others, a part has the bytes that it has in the whole.
TEST(LocalRender, ARegionIsThatPartOfTheWholePicture) {
  JobSpec job = test::box_job();
  job.image = {.width = 21, .height = 17, .sites = 4, .tile_size = 8};
  job.frames = test::frame_numbers(3);
  job.output.aovs = {Aov::source, Aov::normal, Aov::depth};
  for (const Method method : {Method::pool, Method::sequential, Method::bidirectional}) {
    job.sampling.method = method;
    // Blocks of pixels that learn together must not be cut.
    const PixelRect region =
        method == Method::pool ? PixelRect{4, 8, 16, 17} : PixelRect{3, 5, 14, 17};
    job.image.region.reset();
    const std::vector<FilmTile> whole = images(job);
    job.image.region = region;
    const std::vector<FilmTile> part = images(job);
    for (std::size_t frame = 0; frame < whole.size(); ++frame)
      EXPECT_EQ(part[frame], cut(whole[frame], region)) << traits(method).name << " " << frame;
  }
}

// Overscan changes nothing inside, whatever is cut off on the sides.
TEST(LocalRender, APictureIsTheSameBytesWithOverscan) {
  JobSpec job = test::box_job();
  job.image = {.width = 20, .height = 16, .sites = 4, .tile_size = 8};
  job.frames = test::frame_numbers(3);
  job.output.aovs = {Aov::source, Aov::normal, Aov::depth, Aov::motion, Aov::crypto_object};
  for (const Method method : {Method::pool, Method::sequential, Method::bidirectional}) {
    job.sampling.method = method;
    job.image.overscan = {};
    const std::vector<FilmTile> plain = images(job);
    job.image.overscan = {5, 0, 2, 9};
    const std::vector<FilmTile> wide = images(job);
    // With its overscan it begins and ends where blocks do, or the rest does.
    const PixelRect region =
        method == Method::pool ? PixelRect{5, 4, 14, 15} : PixelRect{3, 5, 14, 16};
    const PixelRect rendered{region.x0 - 5, region.y0, region.x1 + 2, region.y1 + 9};
    job.image.region = region;
    const std::vector<FilmTile> part = images(job);
    job.image.region.reset();
    for (std::size_t frame = 0; frame < plain.size(); ++frame) {
      EXPECT_EQ(wide[frame].rect, (PixelRect{-5, 0, 22, 25}));
      EXPECT_EQ(part_of(wide[frame], {0, 0, 20, 16}), plain[frame]) << traits(method).name;
      EXPECT_EQ(part[frame].rect, rendered);
      EXPECT_EQ(part[frame], part_of(wide[frame], rendered))
          << traits(method).name << ": a region with overscan";
    }
  }
}

TEST(LocalRender, TilingsDoNotShowInTheOverscanOfWhatMoves) {
  expect_no_tiling_in_the_second_pass_of_what_moves(
      {.width = 21, .height = 17, .sites = 4, .overscan = {6, 3, 0, 5}});
}

// At the border of the region what moves in starts afresh; nothing else may go wrong.
TEST(LocalRender, TilingsDoNotShowInARegionOfWhatMoves) {
  expect_no_tiling_in_the_second_pass_of_what_moves(
      {.width = 31, .height = 27, .sites = 4, .region = PixelRect{3, 5, 24, 22}});
}

}  // namespace
}  // namespace baton
