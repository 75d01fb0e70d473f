#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/pixel_blocks.h"
#include "worker/pass/round_pixels.h"

namespace baton {

/// The order in which the pixels of a round are worked on, in batches: slots of the round. Where
/// blocks of the picture have something in common, block by block, and the pixels of a block are in
/// one batch: they all start from what the rounds before have left, and share what they find. Else
/// as they come.
class PixelOrder {
 public:
  /// Pixels of what stays together, and of batches.
  enum class Blocks : std::uint8_t { none, of_memory, of_bounces };
  static std::size_t block_pixels(Blocks blocks);

  /// most: pixels of a batch, at least those of a block.
  explicit PixelOrder(std::size_t most) : most_(most) {}
  PixelOrder(const PixelRect& rect, const RoundPixels& pixels, Blocks by, std::size_t most);

  /// Appends the `count` slots after the last one, which stay together: to the last batch, or where
  /// that has no room for them, as a new one. count: [1, most].
  void append(std::size_t count);

  std::size_t num_batches() const { return ends_.size(); }
  std::span<const std::uint32_t> batch(std::size_t i) const {
    const std::size_t first = i == 0 ? 0 : ends_[i - 1];
    return std::span(slots_).subspan(first, ends_[i] - first);
  }

 private:
  /// So many of slots_, after those of the batches, stay together.
  void close(std::size_t count);

  std::size_t most_;
  std::vector<std::uint32_t> slots_;
  std::vector<std::size_t> ends_;  ///< (batches)
};

}  // namespace baton
