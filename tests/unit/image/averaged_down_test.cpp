#include "common/image/averaged_down.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baton {
namespace {

using testing::ElementsAre;

std::vector<float> down(int width, std::vector<float> grey, int new_width, int new_height) {
  RgbImage image{width, static_cast<int>(grey.size()) / width, {}};
  for (const float v : grey) image.rgb.insert(image.rgb.end(), {v, 10 * v, -v});
  const RgbImage result = averaged_down(image, new_width, new_height);
  EXPECT_EQ(result.width, new_width);
  EXPECT_EQ(result.height, new_height);
  std::vector<float> reds;
  for (std::size_t i = 0; i < result.rgb.size(); i += 3) {
    EXPECT_FLOAT_EQ(result.rgb[i + 1], 10 * result.rgb[i]);
    EXPECT_FLOAT_EQ(result.rgb[i + 2], -result.rgb[i]);
    reds.push_back(result.rgb[i]);
  }
  return reds;
}

TEST(AveragedDown, EachPixelIsTheMeanOverItsPart) {
  EXPECT_THAT(down(2, {1, 2, 3, 4}, 2, 2), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(down(4, {1, 3, 5, 7, 3, 5, 7, 9}, 2, 1), ElementsAre(3, 7));
  EXPECT_THAT(down(3, {3, 6, 9}, 2, 1), ElementsAre(4, 8));
  EXPECT_THAT(down(1, {3, 6, 9}, 1, 2), ElementsAre(4, 8));
  EXPECT_THAT(down(5, {0, 1, 2, 3, 4}, 1, 1), ElementsAre(2));
}

TEST(AveragedDown, RowsCountByTheirMeasure) {
  const std::vector<float> image{1, 1, 1, 4, 4, 4};
  const auto row = [&](int y) { return &image[std::size_t{3} * y]; };
  // The lower half is three times as much.
  const RgbImage mean = averaged_down(RowSource{1, 2, row}, 1, 1, [](auto from, auto to) {
    return static_cast<double>(to * to - from * from);
  });
  EXPECT_FLOAT_EQ(mean.rgb.front(), 0.25f * 1 + 0.75f * 4);
}

}  // namespace
}  // namespace baton
