#include "common/scene/plate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/support/image_files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class PlateFile : public testing::Test {
 protected:
  PlateFile() {
    job_.image.width = 2;
    job_.image.height = 1;
    job_.output.background = Background::plate;
  }

  JobSpec job_;
};

TEST_F(PlateFile, IntegersAreSrgbAndFloatsAreLinear) {
  const std::string first =
      test::write_targa("plate.0007.tga", 2, 1, 4, {0, 188, 0, 9, 255, 188, 0, 9});
  const fs::path folder = fs::path(first).parent_path();
  job_.output.plate = FileSequence{.files = (folder / "plate.####.tga").string(), .offset = 5};
  const RgbImage seen = load_plate(job_, FrameNumber(2)).value().picture;
  EXPECT_THAT(seen.rgb, ElementsAre(0, testing::FloatNear(0.5029f, 1e-4f), 0, 1,
                                    testing::FloatNear(0.5029f, 1e-4f), 0));

  const FilmTile film{
      .rect = {0, 0, 4, 2}, .channels = {"R", "G", "B"}, .values = std::vector<float>(24, 0.25f)};
  ASSERT_TRUE(write_exr(folder / "plate.exr", film, {}));
  job_.output.plate = FileSequence{.files = (folder / "plate.exr").string()};
  EXPECT_THAT(load_plate(job_, FrameNumber(2)).value().picture.rgb, testing::Each(0.25f));
}

TEST_F(PlateFile, WhatIsNoNumberBecomesZeroAndIsCountedWhatIsNegativeStays) {
  const float inf = INFINITY, nan = NAN;
  // Twice as large as the picture: planes of two rows. What is repaired counts in the means.
  const FilmTile film{.rect = {0, 0, 4, 2},
                      .channels = {"R", "G", "B"},
                      .values = {inf, 4,  0,  0, 4,  4,    0,  0,  //
                                 nan, 4,  0,  0, 4,  -inf, 0,  0,  //
                                 -8,  -8, -8, 4, -8, -8,   -8, nan}};
  const fs::path exr = fs::path(testing::TempDir()) / "odd.exr";
  ASSERT_TRUE(write_exr(exr, film, {.half_float = false}));
  job_.output.plate = FileSequence{.files = exr.string()};
  const Plate plate = load_plate(job_, FrameNumber(1)).value();
  EXPECT_EQ(plate.repaired, 3u) << "a pixel counts once";
  EXPECT_THAT(plate.picture.rgb, ElementsAre(3, 2, -8, 0, 0, -3));
  EXPECT_THAT(plate_notes("odd.exr", plate),
              testing::ElementsAre("odd.exr: 3 pixels are NaN or infinite and count as 0"));

  const std::string tiff = test::write_tiff("odd.tif", 2, 1, test::TiffExtra::associated,
                                            {-0.5f, 70000, nan, 0.5f, 0.25f, 0.5f, 0.75f, 1});
  job_.output.plate = FileSequence{.files = tiff};
  const Plate floats = load_plate(job_, FrameNumber(1)).value();
  EXPECT_EQ(floats.repaired, 1u);
  EXPECT_THAT(floats.picture.rgb, ElementsAre(-0.5f, 70000, 0, 0.25f, 0.5f, 0.75f));
}

TEST_F(PlateFile, IsTheDisplayWindowOfAnExrFile) {
  const FilmTile film{.rect = {1, 0, 2, 1}, .channels = {"R", "G", "B"}, .values = {5, 6, 7}};
  const fs::path exr = fs::path(testing::TempDir()) / "cropped.exr";
  ASSERT_TRUE(write_exr(exr, film, {.display_window = PixelRect{0, 0, 2, 1}}));
  job_.output.plate = FileSequence{.files = exr.string()};
  EXPECT_THAT(load_plate(job_, FrameNumber(1)).value().picture.rgb, ElementsAre(0, 0, 0, 5, 6, 7));
}

// By the header, whatever reads the format.
TEST_F(PlateFile, MorePixelsThanThereIsMemoryForAreRefused) {
  const std::string tiff = test::write_tiff("many.tif", 4, 2, test::TiffExtra::associated,
                                            std::vector<float>(4 * 8, 0.5f));
  const fs::path exr = fs::path(testing::TempDir()) / "many.exr";
  ASSERT_TRUE(
      write_exr(exr, FilmTile{{0, 0, 4, 2}, {"R", "G", "B"}, std::vector<float>(3 * 8)}, {}));
  job_.image.width = 4;
  job_.image.height = 2;
  for (const std::string& file : {tiff, exr.string()}) {
    job_.output.plate = FileSequence{.files = file};
    EXPECT_TRUE(load_plate(job_, FrameNumber(1), {8}));
    const auto plate = load_plate(job_, FrameNumber(1), {7, ", of 1 MiB"});
    ASSERT_FALSE(plate.ok());
    EXPECT_THAT(plate.error().message,
                HasSubstr(file + ": 4 x 2 pixels, expected at most 0.0 million, of 1 MiB"));
  }
}

TEST_F(PlateFile, FaultsNameTheFileAndTheSize) {
  const fs::path folder = testing::TempDir();
  const auto fault = [&](int width, int height) {
    const FilmTile film{.rect = {0, 0, width, height},
                        .channels = {"R", "G", "B"},
                        .values = std::vector<float>(std::size_t(3 * width * height))};
    EXPECT_TRUE(write_exr(folder / "plate.exr", film, {}));
    const auto plate = load_plate(job_, FrameNumber(1));
    return plate ? std::string("none") : plate.error().message;
  };
  job_.output.plate = FileSequence{.files = (folder / "plate.exr").string()};
  job_.image.width = 90;
  job_.image.height = 61;
  EXPECT_EQ(fault(90, 61), "none");
  EXPECT_EQ(fault(180, 122), "none");
  EXPECT_EQ(fault(100, 68), "none") << "61.2 rows to 90 columns";
  EXPECT_THAT(
      fault(180, 100),
      HasSubstr("plate.exr: expected a plate of the picture's 90 x 61 pixels or of that shape "
                "and larger, got 180 x 100"));
  EXPECT_THAT(fault(45, 31), HasSubstr("got 45 x 31"));
  job_.output.plate->files = (folder / "none.png").string();
  EXPECT_THAT(load_plate(job_, FrameNumber(1)).error().message, HasSubstr("none.png: missing"));
}

}  // namespace
}  // namespace baton
