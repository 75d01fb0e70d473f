#include "worker/run/frame_quality.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// The measure of quality.noiseThreshold: a corner that is noisy counts, one square of 400 does not.
TEST(FrameQuality, TheNoisyCornerDecidesAThreshold) {
  const auto of = [](int noisy_squares) {
    FilmTile image = film(320, 320, {"R", "G", "B", "A", kErrorChannel}, 1);
    for (std::size_t i = 0; i < image.num_pixels(); ++i) {
      const std::size_t square = i % 320 / 16 + 20 * (i / 320 / 16);
      image.plane(4)[i] = square < static_cast<std::size_t>(noisy_squares) ? 0.25f : 0.0001f;
    }
    return judge_frame(image);
  };
  const auto noise = [](double variance) { return std::sqrt(cycles_noise_squared(variance, 1)); };
  EXPECT_NEAR(of(0).cycles_noise, noise(0.0001), 1e-6);
  EXPECT_NEAR(of(4).cycles_noise, noise(0.0001), 1e-6) << "a hundredth of the squares";
  EXPECT_NEAR(of(5).cycles_noise, noise(0.25), 1e-5);
  EXPECT_EQ(of(5).noise_source, NoiseSource::scatter);
}

TEST(FrameQuality, SquaresWithFewSurfacesAreOneAndProbesDecideNothing) {
  FilmTile image = film(16, 16, {"R", "G", "B", "A", kErrorChannel}, 1);
  for (std::size_t i = 0; i < image.num_pixels(); ++i)
    image.plane(4)[i] = i < 60 ? 0.04f : kNoSurface;
  EXPECT_NEAR(judge_frame(image).cycles_noise, std::sqrt(cycles_noise_squared(0.04, 1)), 1e-5);
  image.plane(4)[9] = kErrorUnknown;
  EXPECT_EQ(judge_frame(image).cycles_noise, 0);
}

// All pixels grey .3 with a deviation of .1: what is shown at .2 and at .4 times the exposure that
// shows .3 as .4.
TEST(FrameQuality, NoiseAsShownFollowsTheCurveOfTheDisplay) {
  const FilmTile image = film(8, 8, {"R", "G", "B", "A", kErrorChannel}, 0.3f);
  FilmTile noisy = image;
  std::fill_n(noisy.plane(4), 64, 0.01f);
  const double exposure = std::pow((0.4 + 0.055) / 1.055, 2.4) / 0.3;
  const auto shown = [&](double x) { return 1.055 * std::pow(exposure * x, 1 / 2.4) - 0.055; };
  EXPECT_NEAR(judge_frame(noisy).noise_shown, (shown(0.4) - shown(0.2)) / 2, 1e-4);

  // What is far past white looks clean.
  FilmTile bright = noisy;
  for (std::size_t c = 0; c < 3; ++c) {
    std::fill_n(bright.plane(c), 48, 0.0f);
    std::fill_n(bright.plane(c) + 48, 16, 100.0f);
  }
  std::fill_n(bright.plane(4), 48, 0.0f);
  EXPECT_NEAR(judge_frame(bright).noise_shown, 0, 1e-6);
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
