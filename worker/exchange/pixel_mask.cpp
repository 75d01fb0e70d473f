#include "worker/exchange/pixel_mask.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/base/check.h"

namespace baton {

void PixelMask::add(const PixelMask& other) {
  BATON_CHECK(rect_ == other.rect_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
}

std::vector<std::int32_t> PixelMask::ranks() const {
  std::vector<std::int32_t> ranks(static_cast<std::size_t>(rect_.area()), -1);
  std::int32_t count = 0;
  visit_all([&](std::int32_t x, std::int32_t y) { ranks[index(x, y)] = count++; });
  return ranks;
}

PixelMask dilate(const PixelMask& mask, std::int32_t radius, const PixelMask& allowed,
                 const PixelRect& rect) {
  PixelMask grown(rect);
  mask.visit_all([&](std::int32_t x, std::int32_t y) {
    // Spread to the square around the pixel.
    for (std::int32_t v = std::max(y - radius, rect.y0); v < std::min(y + radius + 1, rect.y1);
         ++v) {
      for (std::int32_t u = std::max(x - radius, rect.x0); u < std::min(x + radius + 1, rect.x1);
           ++u) {
        if (allowed.at(u, v)) grown.set(u, v);
      }
    }
  });
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
  const auto corner = [&](std::int32_t at, std::int32_t shift) {
    const std::int32_t rest = (at + shift) % side_;
    return at - (rest < 0 ? rest + side_ : rest);
  };
  const std::int32_t x0 = corner(x, offset.x), y0 = corner(y, offset.y);
  return {std::max(x0, image_.x0), std::max(y0, image_.y0), std::min(x0 + side_, image_.x1),
          std::min(y0 + side_, image_.y1)};
}

void SquareMembers::list(const PixelMask& mask, const SquarePartitions& partitions,
                         std::int32_t partition, std::int32_t y,
                         std::span<const std::int32_t> names) {
  const PixelRect& rect = mask.rect();
  const PixelRect first_square = partitions.square(partition, rect.x0, y);
  x0_ = rect.x0;
  y0_ = std::max(first_square.y0, rect.y0);
  y1_ = std::min(first_square.y1, rect.y1);
  width_ = static_cast<std::size_t>(rect.width());
  members_.clear();
  first_.resize(width_);
  end_.resize(width_);
  rank_.resize(width_ * static_cast<std::size_t>(y1_ - y0_));

  // List square after square, row by row within.
  for (std::int32_t x = rect.x0; x < rect.x1;) {
    const std::int32_t x1 = std::min(partitions.square(partition, x, y).x1, rect.x1);
    const auto first = static_cast<std::uint32_t>(members_.size());
    for (std::int32_t v = y0_; v < y1_; ++v) {
      mask.visit_row(x, x1, v, [&](std::int32_t u) {
        rank_[static_cast<std::size_t>(v - y0_) * width_ + static_cast<std::size_t>(u - x0_)] =
            static_cast<std::uint16_t>(members_.size() - first);
        members_.push_back(static_cast<std::uint32_t>(names[mask.index(u, v)]));
      });
    }
    for (; x < x1; ++x) {
      first_[static_cast<std::size_t>(x - x0_)] = first;
      end_[static_cast<std::size_t>(x - x0_)] = static_cast<std::uint32_t>(members_.size());
    }
  }
}

}  // namespace baton
