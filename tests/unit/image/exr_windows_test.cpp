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

TEST(ExrWindows, DataThatDoesNotFillTheDisplayIsWhatThereIs) {
  const auto path = written({.half_float = false, .display_window = PixelRect{0, 0, 100, 5}});
  EXPECT_EQ(read_exr(path, ExrWindow::display).value().rect, (PixelRect{0, 0, 32, 5}));
  const auto beside =
      written({.half_float = false, .display_window = PixelRect{100, 100, 120, 130}});
  EXPECT_EQ(read_exr(beside, ExrWindow::display).value(), wide_picture()) << "none in common: all";
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
