#pragma once

#include <cstdint>
#include <vector>

#include "common/math/philox.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// A yes or no for each pixel of a rectangle; outside of it the answer is no.
class PixelMask {
 public:
  explicit PixelMask(const PixelRect& rect)
      : rect_(rect), on_(static_cast<std::size_t>(rect.area()), 0) {}

  const PixelRect& rect() const { return rect_; }
  bool at(std::int32_t x, std::int32_t y) const {
    return rect_.contains(x, y) && on_[index(x, y)] != 0;
  }
  /// The pixel must lie in the rectangle.
  void set(std::int32_t x, std::int32_t y) { on_[index(x, y)] = 1; }
  /// Position of a pixel of the rectangle, row by row.
  std::size_t index(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y - rect_.y0) * static_cast<std::size_t>(rect_.width()) +
           static_cast<std::size_t>(x - rect_.x0);
  }

 private:
  PixelRect rect_;
  std::vector<std::uint8_t> on_;
};

/// `mask` grown by `radius` pixels along both axes (radius 1 is the 3 x 3 kernel of [CV Fig. 6]),
/// within `allowed`. Answers for `rect`; right wherever `mask` reaches `radius` pixels past it.
PixelMask dilate(const PixelMask& mask, std::int32_t radius, const PixelMask& allowed,
                 const PixelRect& rect);

/// The image cut into squares by several partitions of different offsets. Offsets are drawn without
/// replacement among the side^2 possible ones, and again from the start when there are more
/// partitions than that.
class SquarePartitions {
 public:
  /// side >= 1, count >= 1.
  SquarePartitions(const PixelRect& image, std::int32_t side, std::int32_t count, const Rng& rng);

  std::int32_t count() const { return static_cast<std::int32_t>(offsets_.size()); }
  /// The square of partition `partition` that holds the pixel, clipped to the image: the same for
  /// all pixels in it.
  PixelRect square(std::int32_t partition, std::int32_t x, std::int32_t y) const;

 private:
  struct Offset {
    std::int32_t x = 0, y = 0;  ///< [0, side)
  };
  PixelRect image_;
  std::int32_t side_;
  std::vector<Offset> offsets_;
};

}  // namespace baton
