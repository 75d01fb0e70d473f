#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/philox.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// A yes or no for each pixel of a rectangle, one bit each; outside of it the answer is no.
class PixelMask {
 public:
  explicit PixelMask(const PixelRect& rect)
      : rect_(rect),
        words_per_row_(static_cast<std::size_t>(rect.width()) / 64 + 2),
        words_(words_per_row_ * static_cast<std::size_t>(rect.height()), 0) {}

  const PixelRect& rect() const { return rect_; }
  bool at(std::int32_t x, std::int32_t y) const {
    return rect_.contains(x, y) && row_bits(x, x + 1, y) != 0;
  }
  /// The pixel must lie in the rectangle.
  void set(std::int32_t x, std::int32_t y) {
    const auto column = static_cast<std::size_t>(x - rect_.x0);
    words_[first_word(y) + column / 64] |= std::uint64_t{1} << (column % 64);
  }
  /// Bits of pixels [x0, x1) of row y, lowest first; at most 32 pixels, all in the rectangle.
  std::uint32_t row_bits(std::int32_t x0, std::int32_t x1, std::int32_t y) const {
    const auto column = static_cast<std::size_t>(x0 - rect_.x0);
    const std::uint64_t* word = &words_[first_word(y) + column / 64];
    const std::size_t shift = column % 64;
    const std::uint64_t bits = shift == 0 ? word[0] : word[0] >> shift | word[1] << (64 - shift);
    return static_cast<std::uint32_t>(bits & ((std::uint64_t{1} << (x1 - x0)) - 1));
  }
  /// Calls visit(x) for the pixels of row y in [x0, x1), ascending; all of them in the rectangle.
  template <class Visit>
  void visit_row(std::int32_t x0, std::int32_t x1, std::int32_t y, const Visit& visit) const {
    for (; x0 < x1; x0 += 32) {
      for (std::uint32_t bits = row_bits(x0, std::min(x0 + 32, x1), y); bits != 0; bits &= bits - 1)
        visit(x0 + std::countr_zero(bits));
    }
  }
  /// Calls visit(x, y) for all pixels, row by row.
  template <class Visit>
  void visit_all(const Visit& visit) const {
    for (std::int32_t y = rect_.y0; y < rect_.y1; ++y)
      visit_row(rect_.x0, rect_.x1, y, [&](std::int32_t x) { visit(x, y); });
  }
  /// Adds the pixels of a mask of the same rectangle.
  void add(const PixelMask& other);
  /// (pixels of the rectangle) rank of each pixel of the mask, row by row: how many come before
  /// it; -1 for the others.
  std::vector<std::int32_t> ranks() const;
  /// Position of a pixel of a rectangle, row by row.
  std::size_t index(std::int32_t x, std::int32_t y) const { return index(rect_, x, y); }
  static std::size_t index(const PixelRect& rect, std::int32_t x, std::int32_t y) {
    return static_cast<std::size_t>(y - rect.y0) * static_cast<std::size_t>(rect.width()) +
           static_cast<std::size_t>(x - rect.x0);
  }

 private:
  std::size_t first_word(std::int32_t y) const {
    return static_cast<std::size_t>(y - rect_.y0) * words_per_row_;
  }

  PixelRect rect_;
  /// One more than needed, so that row_bits may read two.
  std::size_t words_per_row_;
  std::vector<std::uint64_t> words_;
};

/// `mask` grown by `radius` pixels along both axes (radius 1 is the 3 x 3 kernel of [CV Fig. 6]),
/// within `allowed`. Answers for `rect`; right wherever `mask` reaches `radius` pixels past it.
PixelMask dilate(const PixelMask& mask, std::int32_t radius, const PixelMask& allowed,
                 const PixelRect& rect);

/// The image cut into squares by several partitions of different offsets from pixel (0, 0). Offsets
/// are drawn without replacement among the side^2 possible ones, and again from the start when
/// there are more partitions than that.
class SquarePartitions {
 public:
  /// side >= 1, count >= 1.
  SquarePartitions(const PixelRect& image, std::int32_t side, std::int32_t count, const Rng& rng);

  std::int32_t count() const { return static_cast<std::int32_t>(offsets_.size()); }
  /// The square of partition `partition` with the pixel, clipped to the image: the same for all
  /// pixels in it.
  PixelRect square(std::int32_t partition, std::int32_t x, std::int32_t y) const;

 private:
  struct Offset {
    std::int32_t x = 0, y = 0;  ///< [0, side)
  };
  PixelRect image_;
  std::int32_t side_;
  std::vector<Offset> offsets_;
};

/// The masked pixels of the squares of one partition, one row of squares at a time: what a pixel
/// may offer its samples to.
class SquareMembers {
 public:
  /// Moves to the row of squares with row y of the mask; cheap when it is there already. A square
  /// that reaches past the mask has fewer members here. names: (pixels of the rectangle) what to
  /// call a pixel of the mask.
  void move_to(const PixelMask& mask, const SquarePartitions& partitions, std::int32_t partition,
               std::int32_t y, std::span<const std::int32_t> names) {
    if (y < y0_ || y >= y1_) list(mask, partitions, partition, y, names);
  }

  /// The others in the square of a masked pixel (x, y) of this row of squares.
  struct Others {
    /// Names, row by row, the pixel itself among them.
    const std::uint32_t* members = nullptr;
    std::uint32_t rank = 0;   ///< place of the pixel itself in `members`
    std::uint32_t count = 0;  ///< without it
    /// The k-th other, k < count.
    std::uint32_t pick(std::uint32_t k) const { return members[k + (k >= rank ? 1 : 0)]; }
  };
  Others others(std::int32_t x, std::int32_t y) const {
    const auto column = static_cast<std::size_t>(x - x0_);
    return {members_.data() + first_[column],
            rank_[static_cast<std::size_t>(y - y0_) * width_ + column],
            end_[column] - first_[column] - 1};
  }

 private:
  void list(const PixelMask& mask, const SquarePartitions& partitions, std::int32_t partition,
            std::int32_t y, std::span<const std::int32_t> names);

  std::int32_t x0_ = 0, y0_ = 0, y1_ = 0;  ///< rows that are listed; none at first
  std::size_t width_ = 0;
  std::vector<std::uint32_t> members_;  ///< square after square
  /// (columns of the mask) members of the square of this column: [first, end).
  std::vector<std::uint32_t> first_, end_;
  std::vector<std::uint16_t> rank_;  ///< (rows of squares, columns)
};

}  // namespace baton
