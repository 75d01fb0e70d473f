#include "worker/pass/pixel_order.h"

#include <algorithm>
#include <numeric>

#include "common/base/limits.h"

namespace baton {

void PixelOrder::close(std::size_t count) {
  const std::size_t end = (ends_.empty() ? 0 : ends_.back()) + count;
  const std::size_t begin = ends_.size() < 2 ? 0 : ends_[ends_.size() - 2];
  if (ends_.empty() || end - begin > most_) {
    ends_.push_back(end);
  } else {
    ends_.back() = end;
  }
}

void PixelOrder::append(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    slots_.push_back(static_cast<std::uint32_t>(slots_.size()));
  close(count);
}

namespace {

/// Blocks with a pixel in the rectangle, and each pixel's.
template <std::int32_t kSide>
std::size_t find_blocks(const PixelRect& rect, const RoundPixels& pixels,
                        std::span<std::uint32_t> block_of) {
  const PixelBlocksOf<kSide> blocks(rect);
  for (std::size_t slot = 0; slot < pixels.size(); ++slot)
    block_of[slot] = static_cast<std::uint32_t>(blocks.of(pixels.index(slot)));
  return blocks.count();
}

}  // namespace

std::size_t PixelOrder::block_pixels(Blocks blocks) {
  constexpr std::size_t kMemory = PixelBlocks::kSide, kBounces = limits::kBounceBlock;
  return blocks == Blocks::of_bounces ? kBounces * kBounces : kMemory * kMemory;
}

PixelOrder::PixelOrder(const PixelRect& rect, const RoundPixels& pixels, Blocks by,
                       std::size_t most)
    : most_(most) {
  if (by == Blocks::none) {
    for (std::size_t first = 0; first < pixels.size(); first += most)
      append(std::min(most, pixels.size() - first));
    return;
  }

  // Sort by counting.
  std::vector<std::uint32_t> block_of(pixels.size());
  const std::size_t num_blocks = by == Blocks::of_bounces
                                     ? find_blocks<limits::kBounceBlock>(rect, pixels, block_of)
                                     : find_blocks<PixelBlocks::kSide>(rect, pixels, block_of);
  std::vector<std::size_t> first(num_blocks + 1);
  for (const std::uint32_t block : block_of) ++first[block + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  slots_.resize(pixels.size());
  for (std::size_t slot = 0; slot < pixels.size(); ++slot)
    slots_[next[block_of[slot]]++] = static_cast<std::uint32_t>(slot);

  // As many whole blocks as a batch has room for.
  for (std::size_t block = 0; block < num_blocks; ++block) {
    if (const std::size_t count = first[block + 1] - first[block]; count > 0) close(count);
  }
}

}  // namespace baton
