#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/math/pixel_rect.h"

namespace baton {

/// The blocks of kSide x kSide pixels, one with its corner in pixel (0, 0) of the picture, that
/// have a pixel in a rectangle; row by row. They belong to the picture: whatever a tile is, a block
/// that lies in it whole has the same pixels.
template <std::int32_t kSideOfBlock>
class PixelBlocksOf {
 public:
  static constexpr std::int32_t kSide = kSideOfBlock;

  /// rect: not empty.
  explicit PixelBlocksOf(const PixelRect& rect)
      : rect_(rect),
        first_column_(row_of(rect.x0)),
        first_row_(row_of(rect.y0)),
        columns_(row_of(rect.x1 - 1) - first_column_ + 1),
        rows_(row_of(rect.y1 - 1) - first_row_ + 1) {}

  std::size_t count() const {
    return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  }
  std::int32_t columns() const { return columns_; }
  std::int32_t rows() const { return rows_; }
  /// The block of pixel (x, y) of the rectangle.
  std::size_t at(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>((row_of(y) - first_row_) * columns_ + row_of(x) -
                                    first_column_);
  }
  /// The block of a pixel, row by row in the rectangle.
  std::size_t of(std::size_t pixel) const {
    const auto [x, y] = rect_.place(pixel);
    return at(x, y);
  }
  /// The pixels of a block that lie in the rectangle.
  PixelRect pixels(std::size_t block) const {
    const std::int32_t x = (first_column_ + static_cast<std::int32_t>(block) % columns_) * kSide;
    const std::int32_t y = (first_row_ + static_cast<std::int32_t>(block) / columns_) * kSide;
    return common_part({x, y, x + kSide, y + kSide}, rect_);
  }

 private:
  static_assert(std::has_single_bit(static_cast<std::uint32_t>(kSide)));
  static constexpr std::int32_t row_of(std::int32_t y) {  // rounds towards -infinity
    return y >> std::countr_zero(static_cast<std::uint32_t>(kSide));
  }

  PixelRect rect_;
  std::int32_t first_column_, first_row_, columns_, rows_;
};

/// Pixels that have a memory in common (common/state/block_memory.h).
using PixelBlocks = PixelBlocksOf<4>;

}  // namespace baton
