#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace baton {

/// Half-open rectangle of pixels [x0, x1) x [y0, y1); row 0 is the top of the image.
struct PixelRect {
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  constexpr bool operator==(const PixelRect&) const = default;
  constexpr std::int32_t width() const { return x1 - x0; }
  constexpr std::int32_t height() const { return y1 - y0; }
  constexpr std::int64_t area() const { return std::int64_t{width()} * height(); }
  constexpr bool contains(std::int32_t x, std::int32_t y) const {
    return x >= x0 && x < x1 && y >= y0 && y < y1;
  }
  /// x and y of pixel `index`, row by row.
  constexpr std::array<std::int32_t, 2> place(std::size_t index) const {
    const auto across = static_cast<std::size_t>(width());
    return {x0 + static_cast<std::int32_t>(index % across),
            y0 + static_cast<std::int32_t>(index / across)};
  }
  /// Whether `rect` lies inside.
  constexpr bool contains(const PixelRect& rect) const {
    return rect.x0 >= x0 && rect.y0 >= y0 && rect.x1 <= x1 && rect.y1 <= y1;
  }
  /// Not empty, and inside [-margin, max_side + margin) both ways.
  constexpr bool fits_within(std::int32_t max_side, std::int32_t margin = 0) const {
    return x0 >= -margin && y0 >= -margin && x0 < x1 && y0 < y1 && x1 <= max_side + margin &&
           y1 <= max_side + margin;
  }
};

/// What two rectangles have in common; without area where that is nothing.
constexpr PixelRect common_part(const PixelRect& a, const PixelRect& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

/// `rect` and what lies within `margin` of it, inside of `image`.
constexpr PixelRect grown(const PixelRect& rect, std::int32_t margin, const PixelRect& image) {
  return {std::max(rect.x0 - margin, image.x0), std::max(rect.y0 - margin, image.y0),
          std::min(rect.x1 + margin, image.x1), std::min(rect.y1 + margin, image.y1)};
}

}  // namespace baton
