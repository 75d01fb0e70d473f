#pragma once

#include <array>
#include <cstdint>

#include "common/base/limits.h"
#include "common/math/philox.h"

namespace baton {

/// Pixels that share what their paths find: a square of 4 x 4 in a block of the picture, which goes
/// on at the block's other edges and lies elsewhere in each round.
struct BounceGroup {
  static constexpr std::int32_t kSide = limits::kBounceBlock / 2;
  static constexpr std::uint32_t kMembers = limits::kBounceMembers;
  static_assert(kSide * kSide == limits::kBounceMembers);

  static constexpr std::uint32_t kOfBlock = 4;

  RngKey block;  ///< of the block's first pixel
  /// [0, kOfBlock), and as many again of those that share beside them.
  std::uint32_t number = 0;
  /// [0, kMembers), another one for each pixel of a group: the same in all rounds.
  std::uint32_t member = 0;

  /// That of pixel (x, y) of an image. Other arguments as of pixel_key.
  static BounceGroup of(std::uint64_t job_seed, std::int32_t frame, std::int32_t image_width,
                        std::int32_t x, std::int32_t y, std::int32_t round);
  bool is_same(const BounceGroup& b) const {
    return block.pixel == b.block.pixel && number == b.number;
  }
};

/// Owen-scrambled points of a sequence that belongs to a pixel, or to a group of a block, and to a
/// frame: its rounds follow each other in it.
class BouncePoints {
 public:
  /// is_aside: of a draw that no image has. number: of the group.
  BouncePoints(RngKey key, bool is_aside, std::uint32_t number = 0);
  /// Uniform in [0, 1).
  std::array<float, 2> operator[](std::uint32_t index) const;

 private:
  Philox4x32::Counter scramble_;
};

/// Random numbers of PassId::bounce: steps before those of the surfaces that paths meet, and of
/// these.
enum class BounceStep : std::uint32_t { scramble, scramble_aside, shift };
/// bounce: from 1. path: number of the path in its pixel.
constexpr std::uint32_t bounce_step(std::int32_t bounce, std::uint32_t path) {
  return static_cast<std::uint32_t>(bounce) * limits::kBouncePaths + path;
}
Philox4x32::Counter bounce_bits(const RngKey& key, BounceStep step, std::uint32_t index = 0);

}  // namespace baton
