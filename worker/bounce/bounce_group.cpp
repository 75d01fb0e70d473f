#include "worker/bounce/bounce_group.h"

#include "common/math/low_discrepancy.h"

namespace baton {

Philox4x32::Counter bounce_bits(const RngKey& key, BounceStep step, std::uint32_t index) {
  return Rng(key, PassId::bounce).bits(static_cast<std::uint32_t>(step), index);
}

BounceGroup BounceGroup::of(std::uint64_t job_seed, std::int32_t frame, std::int32_t image_width,
                            std::int32_t x, std::int32_t y, std::int32_t round) {
  constexpr std::int32_t kLast = limits::kBounceBlock - 1, kLastOfSquare = kSide - 1;
  const RngKey block = pixel_key(job_seed, frame, image_width, x & ~kLast, y & ~kLast, round);
  const Philox4x32::Counter shift = bounce_bits(block, BounceStep::shift);
  const auto square = [](std::int32_t at, std::uint32_t by) {
    return ((static_cast<std::uint32_t>(at) + by) & kLast) / kSide;
  };
  return {.block = block,
          .number = 2 * square(y, shift[1]) + square(x, shift[0]),
          .member = static_cast<std::uint32_t>((y & kLastOfSquare) * kSide + (x & kLastOfSquare))};
}

BouncePoints::BouncePoints(RngKey key, bool is_aside, std::uint32_t number) {
  key.round = 0;
  scramble_ =
      bounce_bits(key, is_aside ? BounceStep::scramble_aside : BounceStep::scramble, number);
}

std::array<float, 2> BouncePoints::operator[](std::uint32_t index) const {
  const auto point = sobol_2d(index);
  return {uniform_float(owen_scramble(point[0], scramble_[0])),
          uniform_float(owen_scramble(point[1], scramble_[1]))};
}

}  // namespace baton
