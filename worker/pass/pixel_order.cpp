#include "worker/pass/pixel_order.h"

#include <algorithm>
#include <numeric>

namespace baton {

PixelOrder::PixelOrder(const PixelRect& rect, const RoundPixels& pixels, bool by_blocks,
                       std::size_t most)
    : slots_(pixels.size()) {
  if (!by_blocks) {
    std::iota(slots_.begin(), slots_.end(), 0u);
    for (std::size_t end = std::min(most, slots_.size()); !slots_.empty();
         end = std::min(end + most, slots_.size())) {
      ends_.push_back(end);
      if (end == slots_.size()) break;
    }
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
  for (std::size_t slot = 0; slot < pixels.size(); ++slot)
    slots_[next[block_of[slot]]++] = static_cast<std::uint32_t>(slot);

  // As many whole blocks as a batch has room for.
  std::size_t begin = 0;
  for (std::size_t block = 0; block < blocks.count(); ++block) {
    if (first[block + 1] - begin > most) {
      ends_.push_back(first[block]);
      begin = first[block];
    }
  }
  if (begin < slots_.size()) ends_.push_back(slots_.size());
}

}  // namespace baton
