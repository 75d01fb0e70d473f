#include "worker/pass/pixel_order.h"

#include <algorithm>
#include <numeric>

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

PixelOrder::PixelOrder(const PixelRect& rect, const RoundPixels& pixels, bool by_blocks,
                       std::size_t most)
    : most_(most) {
  if (!by_blocks) {
    for (std::size_t first = 0; first < pixels.size(); first += most)
      append(std::min(most, pixels.size() - first));
    return;
  }

  // Sort by counting.
  const PixelBlocks blocks(rect);
  std::vector<std::uint32_t> block_of(pixels.size());
  std::vector<std::size_t> first(blocks.count() + 1);
  for (std::size_t slot = 0; slot < pixels.size(); ++slot) {
    block_of[slot] = static_cast<std::uint32_t>(blocks.of(pixels.index(slot)));
    ++first[block_of[slot] + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  slots_.resize(pixels.size());
  for (std::size_t slot = 0; slot < pixels.size(); ++slot)
    slots_[next[block_of[slot]]++] = static_cast<std::uint32_t>(slot);

  // As many whole blocks as a batch has room for.
  for (std::size_t block = 0; block < blocks.count(); ++block) {
    if (const std::size_t count = first[block + 1] - first[block]; count > 0) close(count);
  }
}

}  // namespace baton
