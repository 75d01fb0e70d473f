#pragma once

#include <cstdint>
#include <functional>

#include "common/image/image_io.h"

namespace baton {

/// An image row by row.
struct RowSource {
  int width = 0, height = 0;
  /// (width, 3) of row y; rows are asked for from the top, some twice in succession.
  std::function<const float*(int y)> row;
};

/// How much of an image a stretch of its height is; `from` and `to` count from the top in units of
/// 1 / (old height x new height).
using HeightMeasure = std::function<double(std::int64_t from, std::int64_t to)>;

/// The image with `width` columns and `height` rows, no more than it has: each pixel is the mean
/// over its part of the image. Pixels across its edges count for their share, so the mean of the
/// whole is kept for any sizes.
RgbImage averaged_down(const RowSource& image, int width, int height, const HeightMeasure& measure);
/// The same where all rows count alike.
RgbImage averaged_down(const RgbImage& image, int width, int height);

}  // namespace baton
