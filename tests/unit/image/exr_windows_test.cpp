#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/image/image_io.h"

namespace baton {
namespace {

/// 37 x 21 pixels from (-5, -3), every value different.
FilmTile wide_picture() {
  FilmTile film{{-5, -3, 32, 18}, {"A", "B", "G", "R"}, {}};
  for (std::size_t i = 0; i < film.channels.size() * film.num_pixels(); ++i)
    film.values.push_back(static_cast<float>(i) / 1000);
  return film;
}

std::filesystem::path written(const ExrOptions& options) {
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / "baton_windows.exr";
  EXPECT_TRUE(write_exr(path, wide_picture(), options).ok());
  return path;
}

TEST(ExrWindows, DataAndDisplayAreReadApart) {
  const PixelRect shown{0, 0, 30, 16};
  const auto path = written({.half_float = false, .display_window = shown});
  EXPECT_EQ(read_exr(path).value(), wide_picture());
  EXPECT_EQ(read_exr(path, ExrWindow::display).value(), part_of(wide_picture(), shown));
  EXPECT_EQ(read_exr_rows(path, -3, 1).value().rect, (PixelRect{-5, -3, 32, 1}));
  const RgbImage picture = read_rgb_image(path).value();
  EXPECT_EQ(picture.width, 30);
  EXPECT_EQ(picture.height, 16);
  EXPECT_EQ(picture.rgb[0], wide_picture().find("R")[3 * 37 + 5]);
}

TEST(ExrWindows, ThePictureIsTheDisplayWindowAndBlackWhereNoDataIs) {
  const FilmTile data = wide_picture();
  // Cut on top and on the left, larger on the right; inside; all around; beside.
  for (const PixelRect& shown : {PixelRect{0, 0, 100, 5}, PixelRect{3, 4, 5, 6},
                                 PixelRect{-9, -8, 50, 40}, PixelRect{100, 100, 120, 130}}) {
    const auto path = written({.half_float = false, .display_window = shown});
    const FilmTile read = read_exr(path, ExrWindow::display).value();
    ASSERT_EQ(read.rect, shown);
    const RgbImage picture = read_rgb_image(path).value();
    ASSERT_EQ(picture.width, shown.width());
    ASSERT_EQ(picture.height, shown.height());
    for (std::size_t i = 0; i < read.num_pixels(); ++i) {
      const auto [x, y] = shown.place(i);
      const auto in_data =
          static_cast<std::size_t>(y - data.rect.y0) * 37 + static_cast<std::size_t>(x + 5);
      for (std::size_t c = 0; c < 4; ++c)
        ASSERT_EQ(read.plane(c)[i], data.rect.contains(x, y) ? data.plane(c)[in_data] : 0);
      ASSERT_EQ(picture.rgb[3 * i + 2], read.find("B")[i]);
    }
    EXPECT_EQ(read_exr(path).value(), data) << "frames are read back whole";
    const PixelRect seen = common_part(shown, data.rect);
    EXPECT_EQ(read_exr(path, ExrWindow::seen).value().rect, seen.width() > 0 ? seen : shown);
  }
}

TEST(ExrWindows, ADisplayWindowThatIsTooLargeIsAnErrorBeforeItsMemoryIsReserved) {
  for (const PixelRect& shown : {PixelRect{0, 0, 32769, 5}, PixelRect{0, 0, 32768, 16384}}) {
    const auto path = written({.half_float = false, .display_window = shown});
    const auto read = read_exr(path, ExrWindow::display);
    ASSERT_FALSE(read.ok());
    EXPECT_THAT(read.error().message, testing::HasSubstr("baton_windows.exr: a display window of"));
    EXPECT_TRUE(read_exr(path).ok());
  }
}

TEST(ExrWindows, WithoutADisplayWindowAllIsShown) {
  EXPECT_EQ(read_exr(written({.half_float = false}), ExrWindow::display).value(), wide_picture());
}

TEST(ExrWindows, HalvesLieWhereTheyBelong) {
  const FilmTile read = read_exr(written({.display_window = PixelRect{0, 0, 30, 16}})).value();
  const FilmTile wrote = wide_picture();
  for (std::size_t i = 0; i < wrote.values.size(); ++i)
    ASSERT_NEAR(read.values[i], wrote.values[i], 1e-3f + 1e-3f * wrote.values[i]);
}

}  // namespace
}  // namespace baton
