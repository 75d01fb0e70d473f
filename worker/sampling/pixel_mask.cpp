#include "worker/sampling/pixel_mask.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "common/base/check.h"

namespace baton {

MaskedSquare::MaskedSquare(const PixelMask& mask, const PixelRect& rect, std::int32_t x,
                           std::int32_t y) {
  x0_ = std::max(rect.x0, mask.rect().x0);
  y0_ = std::max(rect.y0, mask.rect().y0);
  const std::int32_t x1 = std::min(rect.x1, mask.rect().x1);
  const std::int32_t y1 = std::min(rect.y1, mask.rect().y1);
  BATON_CHECK(x1 - x0_ <= kMaxSide && y1 - y0_ <= kMaxSide);
  for (std::int32_t row = y0_; row < y1; ++row) {
    std::uint32_t bits = mask.row_bits(x0_, x1, row);
    if (row == y) bits &= ~(1u << (x - x0_));
    rows_[static_cast<std::size_t>(row - y0_)] = static_cast<std::uint16_t>(bits);
    count_ += static_cast<std::uint32_t>(std::popcount(bits));
  }
}

MaskedSquare::Pixel MaskedSquare::pick(std::uint32_t rank) const {
  std::size_t row = 0;
  for (auto in_row = static_cast<std::uint32_t>(std::popcount(rows_[row])); rank >= in_row;) {
    rank -= in_row;
    in_row = static_cast<std::uint32_t>(std::popcount(rows_[++row]));
  }
  std::uint32_t bits = rows_[row];
  for (; rank > 0; --rank) bits &= bits - 1;
  return {x0_ + std::countr_zero(bits), y0_ + static_cast<std::int32_t>(row)};
}

PixelMask dilate(const PixelMask& mask, std::int32_t radius, const PixelMask& allowed,
                 const PixelRect& rect) {
  PixelMask grown(rect);
  const PixelRect& from = mask.rect();
  for (std::int32_t y = from.y0; y < from.y1; ++y) {
    for (std::int32_t x = from.x0; x < from.x1; ++x) {
      if (!mask.at(x, y)) continue;
      // Spread to the square around the pixel.
      for (std::int32_t v = std::max(y - radius, rect.y0); v < std::min(y + radius + 1, rect.y1);
           ++v) {
        for (std::int32_t u = std::max(x - radius, rect.x0); u < std::min(x + radius + 1, rect.x1);
             ++u) {
          if (allowed.at(u, v)) grown.set(u, v);
        }
      }
    }
  }
  return grown;
}

SquarePartitions::SquarePartitions(const PixelRect& image, std::int32_t side, std::int32_t count,
                                   const Rng& rng)
    : image_(image), side_(side) {
  BATON_CHECK(side >= 1 && count >= 1);

  // Shuffle all offsets [Fisher & Yates].
  std::vector<std::int32_t> order(static_cast<std::size_t>(side * side));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) {
    const std::uint64_t bits = rng.bits(0, static_cast<std::uint32_t>(i))[0];
    std::swap(order[i - 1], order[static_cast<std::size_t>(bits * i >> 32)]);
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(count); ++c) {
    const std::int32_t offset = order[c % order.size()];
    offsets_.push_back({offset % side, offset / side});
  }
}

PixelRect SquarePartitions::square(std::int32_t partition, std::int32_t x, std::int32_t y) const {
  const Offset& offset = offsets_[static_cast<std::size_t>(partition)];
  const std::int32_t x0 = (x - image_.x0 + offset.x) / side_ * side_ - offset.x + image_.x0;
  const std::int32_t y0 = (y - image_.y0 + offset.y) / side_ * side_ - offset.y + image_.y0;
  return {std::max(x0, image_.x0), std::max(y0, image_.y0), std::min(x0 + side_, image_.x1),
          std::min(y0 + side_, image_.y1)};
}

}  // namespace baton
