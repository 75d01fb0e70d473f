// Philox4x32-10 in SIMD: the same numbers as common/math/philox.h. Included once per Highway
// target.
#if defined(BATON_COMMON_MATH_PHILOX_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_COMMON_MATH_PHILOX_INL_H_
#undef BATON_COMMON_MATH_PHILOX_INL_H_
#else
#define BATON_COMMON_MATH_PHILOX_INL_H_
#endif

#include <hwy/highway.h>

#include "common/math/philox.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Four words of random bits per lane.
template <class VU>
struct PhiloxLanes {
  VU w0, w1, w2, w3;
};

/// Low and high halves of the 64-bit products of 32-bit lanes.
template <class DU, class VU>
HWY_INLINE void MulWide(DU du, VU a, VU b, VU& low, VU& high) {
  const hn::RepartitionToWide<DU> du64;
  const auto even = hn::MulEven(a, b);
  const auto odd = hn::MulEven(hn::BitCast(du, hn::ShiftRight<32>(hn::BitCast(du64, a))),
                               hn::BitCast(du, hn::ShiftRight<32>(hn::BitCast(du64, b))));
  low = hn::OddEven(hn::BitCast(du, hn::ShiftLeft<32>(odd)), hn::BitCast(du, even));
  high = hn::OddEven(hn::BitCast(du, odd), hn::BitCast(du, hn::ShiftRight<32>(even)));
}

/// The block of Rng::bits(step, index) for a vector of indices.
template <class DU, class VU>
HWY_INLINE PhiloxLanes<VU> PhiloxBlock(DU du, const Rng& rng, std::uint32_t step, VU index) {
  auto k0 = static_cast<std::uint32_t>(rng.key().philox_key());
  auto k1 = static_cast<std::uint32_t>(rng.key().philox_key() >> 32);
  PhiloxLanes<VU> c{hn::Set(du, rng.key().pixel), hn::Set(du, rng.key().frame),
                    hn::Set(du, rng.pass_word(step)), index};
  const VU m0 = hn::Set(du, Philox4x32::kMultiplier0);
  const VU m1 = hn::Set(du, Philox4x32::kMultiplier1);
  for (int round = 0; round < Philox4x32::kRounds; ++round) {
    VU low0, high0, low1, high1;
    MulWide(du, c.w0, m0, low0, high0);
    MulWide(du, c.w2, m1, low1, high1);
    c = {hn::Xor(hn::Xor(high1, c.w1), hn::Set(du, k0)), low1,
         hn::Xor(hn::Xor(high0, c.w3), hn::Set(du, k1)), low0};
    k0 += Philox4x32::kWeyl0;
    k1 += Philox4x32::kWeyl1;
  }
  return c;
}

/// uint32 -> uniform in [0, 1), as uniform_float().
template <class D, class VU>
HWY_INLINE hn::Vec<D> UniformLanes(D d, VU bits) {
  const hn::RebindToSigned<D> di;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(bits))), hn::Set(d, 0x1p-24f));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
