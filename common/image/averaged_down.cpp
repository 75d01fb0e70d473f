#include "common/image/averaged_down.h"

#include <algorithm>
#include <vector>

#include "common/base/check.h"

namespace baton {
namespace {

/// Adds a row, times `weight`, to the columns that it lies in. In units of 1 / columns pixel i of
/// the row is [i columns, (i + 1) columns), column k is [k width, (k + 1) width): a pixel has part
/// in two columns at most. columns: (num_columns, 3) sums.
void add_row(const float* row, int width, double weight, std::vector<double>& columns) {
  const auto num_columns = static_cast<std::int64_t>(columns.size()) / 3;
  const double unit = weight / width;
  double* sum = columns.data();
  std::int64_t end = width;
  for (std::int64_t begin = 0; begin < width * num_columns; begin += num_columns, row += 3) {
    if (begin >= end) {
      sum += 3;
      end += width;
    }
    const std::int64_t inside = std::min(end - begin, num_columns);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += unit * static_cast<double>(inside) * row[k];
    if (inside == num_columns) continue;
    const double outside = unit * static_cast<double>(num_columns - inside);
    for (std::size_t k = 0; k < 3; ++k) sum[3 + k] += outside * row[k];
  }
}

}  // namespace

RgbImage averaged_down(const RowSource& image, int width, int height,
                       const HeightMeasure& measure) {
  BATON_CHECK(width > 0 && width <= image.width && height > 0 && height <= image.height);
  RgbImage result{width, height, {}};
  result.rgb.reserve(std::size_t{3} * static_cast<std::size_t>(width) * height);
  std::vector<double> sums(static_cast<std::size_t>(width) * 3);
  for (std::int64_t r = 0; r < height; ++r) {
    const std::int64_t top = r * image.height, bottom = top + image.height;
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::int64_t y = top / height; y * height < bottom; ++y) {
      const std::int64_t from = std::max(y * height, top);
      const std::int64_t to = std::min((y + 1) * height, bottom);
      add_row(image.row(static_cast<int>(y)), image.width, measure(from, to) / measure(top, bottom),
              sums);
    }
    for (const double sum : sums) result.rgb.push_back(static_cast<float>(sum));
  }
  return result;
}

RgbImage averaged_down(const RgbImage& image, int width, int height) {
  const auto row = [&](int y) { return &image.rgb[static_cast<std::size_t>(y) * image.width * 3]; };
  const auto length = [](std::int64_t from, std::int64_t to) {
    return static_cast<double>(to - from);
  };
  return averaged_down(RowSource{image.width, image.height, row}, width, height, length);
}

}  // namespace baton
