#include "worker/run/frame_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/image/noise.h"

namespace baton {
namespace {

FilmTile film(int width, int height, const std::vector<std::string>& channels, float value) {
  FilmTile film{.rect = {0, 0, width, height}, .channels = channels, .values = {}};
  film.values.assign(channels.size() * film.num_pixels(), value);
  return film;
}

TEST(FrameQuality, NoiseIsToldByTheErrorsOfAFilm) {
  FilmTile image = film(10, 10, {"R", "G", "B", "A", kErrorChannel}, 4);
  for (std::size_t i = 0; i < 100; ++i)
    image.plane(4)[i] = i < 50 ? kNoSurface : i % 25 == 0 ? 0.16f : i % 25 == 1 ? 0.64f : -1;
  const FrameQuality seen = judge_frame(image);
  EXPECT_EQ(seen.noise_source, NoiseSource::probes);
  EXPECT_NEAR(seen.noise, std::sqrt(0.4f) / 4, 1e-5f);
  EXPECT_NEAR(seen.noise_error, std::sqrt(0.36f / 3) / 2, 1e-5f);
}

TEST(FrameQuality, NoiseIsNotToldWithoutErrors) {
  EXPECT_EQ(judge_frame(film(10, 10, {"R", "G", "B", "A"}, 4)).noise_source, NoiseSource::none);
  EXPECT_EQ(judge_frame(film(10, 10, {"R", "G", "B", "A", kErrorChannel}, kErrorUnknown)).noise, 0);
}

TEST(FrameQuality, OddValuesAreCountedOnceAPixel) {
  FilmTile image = film(10, 10, {"B", "A", "R", "G"}, 1);
  image.find("R")[3] = -2;
  image.find("G")[3] = -1;
  image.find("A")[4] = -9;
  image.find("B")[5] = 65504;
  image.find("B")[6] = 65505;
  image.find("G")[7] = std::numeric_limits<float>::quiet_NaN();
  image.find("G")[8] = std::numeric_limits<float>::infinity();
  const FrameQuality seen = judge_frame(image);
  EXPECT_EQ(seen.pixels, 100u);
  EXPECT_EQ(seen.pixels_below_zero, 1u);
  EXPECT_EQ(seen.lowest, -2);
  EXPECT_EQ(seen.pixels_beyond_half, 1u);
  EXPECT_EQ(seen.pixels_not_finite, 2u);
  const float sum = 98 * 3 - 2 - 2 - 3 + 65504 + 65505 - 0;
  EXPECT_NEAR(seen.light_below_zero, 3 / sum, 1e-7f);

  // What clamping adds is what was told.
  const float before = seen.mean;
  clamp_negative(image);
  const FrameQuality after = judge_frame(image);
  EXPECT_EQ(after.pixels_below_zero, 0u);
  EXPECT_NEAR(after.mean / before - 1, seen.light_below_zero, 1e-6f);
  EXPECT_EQ(image.find("A")[4], -9) << "not a colour";
}

TEST(FrameQuality, BlackHasNoNoise) {
  const FrameQuality seen = judge_frame(film(8, 8, {"R", "G", "B", "A"}, 0));
  EXPECT_EQ(seen.noise_source, NoiseSource::none);
  EXPECT_EQ(seen.pixels, 64u);
}

}  // namespace
}  // namespace baton
