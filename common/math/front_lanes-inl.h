// Moving the wanted lanes of a vector to its front. Included once per Highway target.
#if defined(BATON_COMMON_MATH_FRONT_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_COMMON_MATH_FRONT_LANES_INL_H_
#undef BATON_COMMON_MATH_FRONT_LANES_INL_H_
#else
#define BATON_COMMON_MATH_FRONT_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <bit>

#include "common/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// By mask of eight lanes: the lanes that are set, then zeros.
inline constexpr auto kLanesOfMask = [] {
  std::array<std::array<std::uint8_t, 8>, 256> table{};
  for (std::size_t mask = 0; mask < table.size(); ++mask) {
    std::size_t kept = 0;
    for (std::uint8_t lane = 0; lane < 8; ++lane) {
      if ((mask >> lane & 1) != 0) table[mask][kept++] = lane;
    }
  }
  return table;
}();

/// Where each lane comes from when those of `mask` move to the front; kept: how many they are.
/// (Highway 1.0's Compress copies its table of permutations at every call.)
HWY_INLINE auto FrontLanes(MF mask, std::size_t& kept) {
  const DF d;
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, mask, bits);
  kept = static_cast<std::size_t>(std::popcount(bits[0]));
  const auto lanes = hn::LoadU(hn::Rebind<std::uint8_t, DF>(), kLanesOfMask[bits[0]].data());
  return hn::IndicesFromVec(d, hn::PromoteTo(DI(), lanes));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
