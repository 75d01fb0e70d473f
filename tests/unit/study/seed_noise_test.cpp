#include "jobs/study/seed_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

constexpr int kPixels = 4;

/// One row of pixels of a wall: grey values, all seen at depth 5 from ahead.
FilmTile row(std::initializer_list<float> grey) {
  FilmTile film{.rect = {0, 0, kPixels, 1},
                .channels = {"A", "B", "G", "R", "depth", "normal.X", "normal.Y", "normal.Z"},
                .values = std::vector<float>(8 * kPixels, 0.0f)};
  std::fill_n(film.find("A"), kPixels, 1.0f);
  for (const char* channel : {"R", "G", "B"})
    std::copy(grey.begin(), grey.end(), film.find(channel));
  std::fill_n(film.find("depth"), kPixels, 5.0f);
  std::fill_n(film.find("normal.Z"), kPixels, 1.0f);
  return film;
}

// 99 and 101 differ by 2 % of their mean: one of them deviates by sqrt(2) %.
TEST(SeedNoise, IsTheDeviationOfOneSeed) {
  SeedNoise noise;
  ASSERT_TRUE(noise.add(row({99, 99, 101, 101}), row({101, 101, 99, 99})).ok());
  EXPECT_EQ(noise.pixels, 4);
  EXPECT_NEAR(noise.deviation(), 0.02 / std::sqrt(2.0), 1e-5);
  EXPECT_EQ(SeedNoise().deviation(), 0);
}

// A pixel that sees another surface, or partly nothing, is left out.
TEST(SeedNoise, LooksAtPixelsThatSeeTheSame) {
  const FilmTile a = row({1, 1, 1, 1});
  FilmTile b = row({9, 9, 9, 1});
  b.find("A")[0] = 0.75f;
  b.find("depth")[1] = 5.1f;
  b.find("normal.X")[2] = 0.1f;
  SeedNoise noise;
  ASSERT_TRUE(noise.add(a, b).ok());
  EXPECT_EQ(noise.pixels, 1);
  EXPECT_EQ(noise.deviation(), 0);
}

TEST(SeedNoise, NamesAChannelThatIsNotThere) {
  FilmTile without = row({1, 1, 1, 1});
  without.channels[4] = "Z";
  const Status added = SeedNoise().add(row({1, 1, 1, 1}), without);
  ASSERT_FALSE(added.ok());
  EXPECT_EQ(added.error().message, "expected a channel depth");
}

}  // namespace
}  // namespace baton
