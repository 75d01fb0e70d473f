#include "common/state/bin_kernels.h"

#include <bit>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/state/bin_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

std::size_t CompressBins(const VisibilityCell* HWY_RESTRICT bins, std::uint8_t* HWY_RESTRICT mask,
                         VisibilityCell* HWY_RESTRICT cells) {
  const hn::CappedTag<VisibilityCell, 32> d;
  static_assert(hn::MaxLanes(d) >= 8, "a vector's part of the mask is whole bytes");
  std::size_t count = 0;
  for (std::size_t i = 0; i < VisibilityBins::kCount; i += hn::Lanes(d)) {
    const auto bin = hn::LoadU(d, bins + i);
    const auto is_reached = hn::Ne(bin, hn::Zero(d));
    hn::StoreMaskBits(d, is_reached, mask + i / 8);
    count += hn::CompressStore(bin, is_reached, d, cells + count);
  }
  return count;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {

HWY_EXPORT(CompressBins);

std::size_t compress_bins(const VisibilityCell* bins, PixelMemories::BinMask& mask,
                          VisibilityCell* cells) {
  static_assert(std::endian::native == std::endian::little, "bit i of word j is bin 64 j + i");
  return HWY_DYNAMIC_DISPATCH(CompressBins)(bins, reinterpret_cast<std::uint8_t*>(mask.data()),
                                            cells);
}

}  // namespace baton
#endif
