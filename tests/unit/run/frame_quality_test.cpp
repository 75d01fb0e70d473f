#include "worker/run/frame_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace baton {
namespace {

FilmTile film(int width, int height, const std::vector<std::string>& channels, float value) {
  FilmTile film{.rect = {0, 0, width, height}, .channels = channels, .values = {}};
  film.values.assign(channels.size() * film.num_pixels(), value);
  return film;
}

/// Grey noise of this relative deviation on a radiance of 2.
FilmTile noisy(float relative, unsigned seed) {
  FilmTile image = film(120, 90, {"R", "G", "B", "A"}, 1);
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, relative);
  for (std::size_t i = 0; i < image.num_pixels(); ++i) {
    const float grey = 2 * (1 + normal(random));
    for (std::size_t c = 0; c < 3; ++c) image.plane(c)[i] = grey;
  }
  return image;
}

TEST(FrameQuality, NoiseIsToldFromNeighboursWhereNoErrorIsKnown) {
  for (const float relative : {0.02f, 0.2f}) {
    const FrameQuality seen = judge_frame(noisy(relative, 3));
    EXPECT_EQ(seen.noise_source, NoiseSource::neighbors);
    EXPECT_NEAR(seen.noise / relative, 1, 0.04) << relative;
    EXPECT_NEAR(seen.mean, 2, 0.03);
  }
}

TEST(FrameQuality, SaltAndPepperIsNoise) {
  FilmTile image = film(100, 100, {"R", "G", "B", "A"}, 1);
  for (std::size_t i = 7; i < image.num_pixels(); i += 100) image.plane(0)[i] = 301;
  // One pixel of 100 is 100 brighter in grey: rms 10 over a mean of 2.
  EXPECT_NEAR(judge_frame(image).noise, 5 / std::sqrt(1.18), 0.1);
}

TEST(FrameQuality, EdgesCountLittle) {
  const auto edge = [](std::size_t rows_a_step) {
    FilmTile image = film(100, 100, {"R", "G", "B", "A"}, 1);
    for (std::size_t i = 0; i < image.num_pixels(); ++i) {
      const bool bright = i % 100 > 40 + (i / 100) / rows_a_step;
      for (std::size_t c = 0; c < 3 && bright; ++c) image.plane(c)[i] = 10;
    }
    return judge_frame(image).noise;
  };
  EXPECT_LT(edge(1000), 1e-6f) << "a straight one of 1 : 10";
  EXPECT_LT(edge(3), 0.1f) << "its steps count; their rms to the mean of their neighbours is 0.3";
}

TEST(FrameQuality, WhatIsTransparentIsLeftOut) {
  FilmTile image = noisy(0.1f, 4);
  for (std::size_t i = 0; i < image.num_pixels(); ++i) {
    if (i % 120 < 60) continue;
    for (std::size_t c = 0; c < 4; ++c) image.plane(c)[i] = 0;
  }
  EXPECT_NEAR(judge_frame(image).noise, 0.1, 0.01);
}

TEST(FrameQuality, AKnownErrorIsTaken) {
  FilmTile image = film(10, 10, {"R", "G", "B", "A", "variance"}, 0);
  for (std::size_t i = 0; i < 50; ++i) {  // half of the pixels see a surface
    for (std::size_t c = 0; c < 3; ++c) image.plane(c)[i] = 4;
    image.plane(4)[i] = i % 2 == 0 ? 0.16f : 0.64f;
  }
  const FrameQuality seen = judge_frame(image);
  EXPECT_EQ(seen.noise_source, NoiseSource::halves);
  EXPECT_NEAR(seen.noise, std::sqrt(0.4f) / 4, 1e-5f) << "over the pixels that have an error";
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
