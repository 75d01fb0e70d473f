#include "common/image/contact_sheet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace baton {
namespace {

RgbImage flat(int width, int height, float r, float g, float b) {
  RgbImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i) image.rgb.insert(image.rgb.end(), {r, g, b});
  return image;
}

const float* pixel(const RgbImage& image, int x, int y) {
  return image.rgb.data() + (y * image.width + x) * 3;
}

/// What tone_map makes of one colour at exposure 1.
RgbImage mapped(float r, float g, float b) { return tone_map(flat(1, 1, r, g, b), 1); }

TEST(AutoExposure, MakesTheLogAverageMiddleGrey) {
  EXPECT_NEAR(auto_exposure(flat(3, 2, 0.18f, 0.18f, 0.18f)), 1, 1e-4f);
  RgbImage image = flat(2, 1, 0.01f, 0.01f, 0.01f);
  std::fill(image.rgb.begin() + 3, image.rgb.end(), 1.0f);
  EXPECT_NEAR(auto_exposure(image), 0.18f / 0.1f, 1e-3f);
}

TEST(AutoExposure, IgnoresBlackAndBrokenPixels) {
  RgbImage image = flat(4, 1, 0, 0, 0);
  EXPECT_EQ(auto_exposure(image), 1);
  std::fill_n(image.rgb.begin(), 3, 0.36f);
  image.rgb[3] = std::numeric_limits<float>::quiet_NaN();
  image.rgb[6] = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(auto_exposure(image), 0.5f, 1e-4f);
}

TEST(ToneMap, RisesFromBlackToWhite) {
  float last = -1;
  for (const float value : {0.0f, 0.01f, 0.1f, 0.5f, 1.0f, 4.0f, 7.9f}) {
    const RgbImage out = mapped(value, value, value);
    EXPECT_GT(out.rgb[0], last) << value;
    last = out.rgb[0];
  }
  EXPECT_EQ(mapped(0, 0, 0).rgb[0], 0);
  EXPECT_NEAR(mapped(8, 8, 8).rgb[0], 1, 1e-6f);
  EXPECT_EQ(mapped(1e6f, 1e6f, 1e6f).rgb[0], 1);
}

TEST(ToneMap, KeepsDarkHuesAndFadesBrightOnes) {
  const RgbImage dark = mapped(0.02f, 0.01f, 0.005f);
  EXPECT_NEAR(dark.rgb[0] / dark.rgb[1], 2, 0.05f);
  const RgbImage bright = mapped(80, 40, 20);
  EXPECT_EQ(bright.rgb[0], 1);
  EXPECT_EQ(bright.rgb[2], 1);
}

TEST(ToneMap, ExposureMultipliesAndBrokenValuesAreBlack) {
  EXPECT_EQ(tone_map(flat(1, 1, 0.1f, 0.2f, 0.3f), 4).rgb, mapped(0.4f, 0.8f, 1.2f).rgb);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float value : mapped(std::nanf(""), -1, kInfinity).rgb) EXPECT_EQ(value, 0);
}

TEST(ContactSheet, PlacesFramesInReadingOrderWithGaps) {
  const RgbImage frames[] = {flat(8, 4, 1, 0, 0), flat(8, 4, 0, 1, 0), flat(8, 4, 0, 0, 1)};
  const RgbImage sheet = contact_sheet(frames, 2, 4);
  EXPECT_EQ(sheet.width, 2 + 2 * (4 + 2));
  EXPECT_EQ(sheet.height, 2 + 2 * (2 + 2));
  EXPECT_EQ(pixel(sheet, 2, 2)[0], 1);
  EXPECT_EQ(pixel(sheet, 5, 3)[0], 1);
  EXPECT_EQ(pixel(sheet, 8, 2)[1], 1);
  EXPECT_EQ(pixel(sheet, 2, 6)[2], 1);
  const float gap = pixel(sheet, 0, 0)[0];
  EXPECT_EQ(pixel(sheet, 6, 2)[0], gap);
  EXPECT_EQ(pixel(sheet, 8, 6)[0], gap) << "the missing fourth frame";
}

TEST(ContactSheet, ShrinksByTheMeanOfWholeBoxes) {
  RgbImage frame = flat(4, 2, 0, 0, 0);
  for (const int i : {0, 4}) frame.rgb[static_cast<std::size_t>(i) * 3] = 1;
  const RgbImage sheet = contact_sheet({&frame, 1}, 5, 2);
  EXPECT_EQ(sheet.width, 6);
  EXPECT_EQ(sheet.height, 5);
  EXPECT_EQ(pixel(sheet, 2, 2)[0], 0.5f);
  EXPECT_EQ(pixel(sheet, 3, 2)[0], 0);
}

TEST(Resize, KeepsTheAspectAndTheMean) {
  RgbImage frame = flat(4, 2, 0, 0, 0);
  for (const int i : {0, 4}) frame.rgb[static_cast<std::size_t>(i) * 3] = 1;
  const RgbImage half = resize(frame, 2);
  EXPECT_EQ(half.width, 2);
  EXPECT_EQ(half.height, 1);
  EXPECT_EQ(half.rgb, (std::vector<float>{0.5f, 0, 0, 0, 0, 0}));
  EXPECT_EQ(resize(frame, 4).rgb, frame.rgb);
  EXPECT_EQ(resize(flat(100, 1, 1, 1, 1), 10).height, 1) << "never empty";
}

TEST(ContactSheet, EnlargedPixelsBecomeRectangles) {
  RgbImage frame = flat(2, 1, 0, 0, 0);
  frame.rgb[0] = 1;
  const RgbImage sheet = contact_sheet({&frame, 1}, 1, 4);
  EXPECT_EQ(pixel(sheet, 3, 3)[0], 1);
  EXPECT_EQ(pixel(sheet, 4, 3)[0], 0);
}

TEST(ContactSheet, WritesFrameNumbersIntoTheLowerLeftCorners) {
  RgbImage grey{40, 30, std::vector<float>(40 * 30 * 3, 0.5f)};
  const std::vector<RgbImage> frames{grey, grey};
  const std::vector<int> numbers{7, 41};
  const RgbImage sheet = contact_sheet(frames, 2, 40, numbers);
  // As text, one character a dot: of 2 x 2 pixels, from the upper left corner of a number's box.
  const auto dots = [&](int left, int columns) {
    std::string text;
    for (int row = 0; row < 7; ++row) {
      for (int column = 0; column < columns; ++column) {
        const int x = left + 2 * column, y = 2 + 30 - 14 + 2 * row;
        const float value = sheet.rgb[static_cast<std::size_t>((y * sheet.width + x) * 3)];
        text += value == 1 ? '#' : value == 0 ? '.' : '?';
      }
      text += '\n';
    }
    return text;
  };
  EXPECT_EQ(dots(2, 6),
            ".....?\n"
            ".###.?\n"
            "...#.?\n"
            "..#..?\n"
            "..#..?\n"
            "..#..?\n"
            ".....?\n");
  EXPECT_EQ(dots(44, 9),
            ".........\n"
            ".#.#..#..\n"
            ".#.#.##..\n"
            ".###..#..\n"
            "...#..#..\n"
            "...#.###.\n"
            ".........\n");
}

}  // namespace
}  // namespace baton
