// Vectors of directions and the functions of them that every SIMD kernel needs. Included once per
// Highway target.
#if defined(BATON_COMMON_MATH_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_COMMON_MATH_LANES_INL_H_
#undef BATON_COMMON_MATH_LANES_INL_H_
#else
#define BATON_COMMON_MATH_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "common/math/vec3.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// After the parameters of a lambda that a loop over vectors calls: it becomes part of the loop, so
/// that what it adds to stays in registers.
#define BATON_IN_LOOP HWY_ATTR __attribute__((always_inline))

/// All kernels work on (up to) eight float lanes: wide enough for AVX2, and the same grouping on
/// wider machines.
using DF = hn::CappedTag<float, 8>;
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using DB = hn::Rebind<std::uint8_t, DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;
using MF = hn::Mask<DF>;

/// One 3-vector per lane.
struct Vec3Lanes {
  VF x, y, z;
};

HWY_INLINE VF Dot(const Vec3Lanes& a, const Vec3Lanes& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE Vec3Lanes Scale(const Vec3Lanes& a, VF s) {
  return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)};
}
HWY_INLINE Vec3Lanes Add(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
/// a s + b.
HWY_INLINE Vec3Lanes AddScaled(const Vec3Lanes& a, VF s, const Vec3Lanes& b) {
  return {hn::MulAdd(a.x, s, b.x), hn::MulAdd(a.y, s, b.y), hn::MulAdd(a.z, s, b.z)};
}
/// a b + c, component by component.
HWY_INLINE Vec3Lanes AddProduct(const Vec3Lanes& a, const Vec3Lanes& b, const Vec3Lanes& c) {
  return {hn::MulAdd(a.x, b.x, c.x), hn::MulAdd(a.y, b.y, c.y), hn::MulAdd(a.z, b.z, c.z)};
}
HWY_INLINE Vec3Lanes Select(MF mask, const Vec3Lanes& yes, const Vec3Lanes& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.z, no.z)};
}
/// first, first + 1, ... (Highway 1.0's Iota of a variable stores them one by one and waits for
/// them.)
template <class D>
HWY_INLINE hn::Vec<D> CountFrom(D d, hn::TFromD<D> first) {
  return hn::Add(hn::Iota(d, 0), hn::Set(d, first));
}
/// v = 0, lane by lane: what GCC copies as a whole it loads in larger pieces than it has just
/// stored.
HWY_INLINE void SetZero(Vec3Lanes& v) { v.x = v.y = v.z = hn::Zero(DF()); }
HWY_INLINE Rgb SumOfLanes(const Vec3Lanes& v) {
  const auto sum = [](VF x) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(DF(), x)); };
  return {sum(v.x), sum(v.y), sum(v.z)};
}
/// Up to a vector from `array` at i, the rest zero; and back. Whole vectors, which most are, pass
/// no memory in between: what is stored in pieces and loaded at once waits for the stores.
template <class D>
HWY_INLINE hn::Vec<D> LoadSome(D d, std::span<const hn::TFromD<D>> array, std::size_t i) {
  if (i + hn::Lanes(d) <= array.size()) return hn::LoadU(d, array.data() + i);
  HWY_ALIGN hn::TFromD<D> in[hn::MaxLanes(d)] = {};
  std::copy_n(array.data() + i, array.size() - i, in);
  return hn::Load(d, in);
}
template <class D>
HWY_INLINE void StoreSome(D d, hn::Vec<D> value, std::span<hn::TFromD<D>> array, std::size_t i) {
  if (i + hn::Lanes(d) <= array.size()) return hn::StoreU(value, d, array.data() + i);
  HWY_ALIGN hn::TFromD<D> out[hn::MaxLanes(d)];
  hn::Store(value, d, out);
  std::copy_n(out, array.size() - i, array.data() + i);
}
HWY_INLINE VF LoadSome(std::span<const float> array, std::size_t i) {
  return LoadSome(DF(), array, i);
}
HWY_INLINE void StoreSome(VF value, std::span<float> array, std::size_t i) {
  StoreSome(DF(), value, array, i);
}
/// Small numbers, such as sites, that are kept in bytes; and back.
HWY_INLINE VI LoadBytes(std::span<const std::uint8_t> array, std::size_t i) {
  return hn::PromoteTo(DI(), LoadSome(DB(), array, i));
}
HWY_INLINE void StoreBytes(VI value, std::span<std::uint8_t> array, std::size_t i) {
  StoreSome(DB(), hn::DemoteTo(DB(), value), array, i);
}
/// Records of floats, one a lane of a vector.
using Records = std::array<const float*, 8>;
static_assert(hn::MaxLanes(DF()) == 4 || hn::MaxLanes(DF()) == 8);

/// Four floats of the records k, k + 4, ..., block after block of a vector.
template <class D>
HWY_INLINE hn::Vec<D> LoadBlocks(D d, const float* const* record, int field) {
  if constexpr (hn::MaxLanes(D()) > 4) {
    const hn::Half<D> half;
    return hn::Combine(d, LoadBlocks(half, record + 4, field), LoadBlocks(half, record, field));
  } else {
    return hn::LoadU(d, *record + field);
  }
}

/// Four fields of all records of a vector, a row each.
struct FourRows {
  VF row[4];
};
/// From blocks as LoadBlocks reads them for k = 0 ... 3: 4 x 4 transposes in registers, which beat
/// gathers and copies lane by lane.
HWY_INLINE FourRows TransposeBlocks(VF k0, VF k1, VF k2, VF k3) {
  const DF d;
  const VF low02 = hn::InterleaveLower(d, k0, k2);
  const VF low13 = hn::InterleaveLower(d, k1, k3);
  const VF high02 = hn::InterleaveUpper(d, k0, k2);
  const VF high13 = hn::InterleaveUpper(d, k1, k3);
  return {{hn::InterleaveLower(d, low02, low13), hn::InterleaveUpper(d, low02, low13),
           hn::InterleaveLower(d, high02, high13), hn::InterleaveUpper(d, high02, high13)}};
}
/// Fields first, ..., first + 3 of every record.
HWY_INLINE FourRows LoadFour(const Records& records, int first) {
  const DF d;
  return TransposeBlocks(LoadBlocks(d, &records[0], first), LoadBlocks(d, &records[1], first),
                         LoadBlocks(d, &records[2], first), LoadBlocks(d, &records[3], first));
}

/// Block after block of a vector to address(block), in pieces of four floats.
template <class D, class Address>
HWY_INLINE void StoreBlocks(D d, hn::Vec<D> v, const Address& address, std::size_t first = 0) {
  if constexpr (hn::MaxLanes(D()) > 4) {
    const hn::Half<D> half;
    StoreBlocks(half, hn::LowerHalf(half, v), address, first);
    StoreBlocks(half, hn::UpperHalf(half, v), address, first + 1);
  } else {
    hn::StoreU(v, d, address(first));
  }
}

/// Mean of the three channels.
HWY_INLINE VF MeanLanes(const Vec3Lanes& c) {
  return hn::Mul(hn::Add(hn::Add(c.x, c.y), c.z), hn::Set(DF(), 1.0f / 3.0f));
}
/// m * v, m row-major.
HWY_INLINE Vec3Lanes Transform(const float* m, const Vec3Lanes& v) {
  const DF d;
  const auto row = [&](int r) HWY_ATTR {
    return Dot({hn::Set(d, m[r * 3]), hn::Set(d, m[r * 3 + 1]), hn::Set(d, m[r * 3 + 2])}, v);
  };
  return {row(0), row(1), row(2)};
}
/// 1 / sqrt(x) to float accuracy.
HWY_INLINE VF InverseSqrt(VF x) { return hn::Div(hn::Set(DF(), 1.0f), hn::Sqrt(x)); }

/// The two axes beside unit n of a frame around it, as in common/math/vec3.h [Duff et al. 2017].
struct FrameAxes {
  Vec3Lanes x, y;
};
HWY_INLINE FrameAxes AxesAround(const Vec3Lanes& n) {
  const DF d;
  const VF one = hn::Set(d, 1.0f);
  const VF sign = hn::CopySign(one, n.z);
  const VF a = hn::Div(hn::Set(d, -1.0f), hn::Add(sign, n.z));
  const VF b = hn::Mul(hn::Mul(n.x, n.y), a);
  return {{hn::MulAdd(hn::Mul(sign, n.x), hn::Mul(n.x, a), one), hn::Mul(sign, b),
           hn::Neg(hn::Mul(sign, n.x))},
          {b, hn::MulAdd(hn::Mul(n.y, n.y), a, sign), hn::Neg(n.y)}};
}
/// v.x * frame x + v.y * frame y + v.z * n.
HWY_INLINE Vec3Lanes FrameToWorld(const Vec3Lanes& n, const Vec3Lanes& v) {
  const FrameAxes frame = AxesAround(n);
  return Add(Add(Scale(frame.x, v.x), Scale(frame.y, v.y)), Scale(n, v.z));
}
/// Components of world vector v in the same frame.
HWY_INLINE Vec3Lanes FrameToLocal(const Vec3Lanes& n, const Vec3Lanes& v) {
  const FrameAxes frame = AxesAround(n);
  return {Dot(frame.x, v), Dot(frame.y, v), Dot(n, v)};
}

/// sin and cos of 2 pi u for u in [0, 1): odd and even minimax polynomials on a quarter turn, error
/// below 4e-7.
HWY_INLINE void SinCosTurns(VF u, VF& sine, VF& cosine) {
  const DF d;
  // Reduce to r in [-1/8, 1/8] turns around the nearest quarter.
  const VF quarter = hn::Round(hn::Mul(u, hn::Set(d, 4.0f)));
  const VF r = hn::Mul(hn::NegMulAdd(quarter, hn::Set(d, 0.25f), u), hn::Set(d, 2 * kPi));
  const VF r2 = hn::Mul(r, r);
  VF s = hn::MulAdd(r2, hn::Set(d, -1.9515295891e-4f), hn::Set(d, 8.3321608736e-3f));
  s = hn::MulAdd(hn::MulAdd(r2, s, hn::Set(d, -1.6666654611e-1f)), hn::Mul(r2, r), r);
  VF c = hn::MulAdd(r2, hn::Set(d, 2.443315711809948e-5f), hn::Set(d, -1.388731625493765e-3f));
  c = hn::MulAdd(r2, c, hn::Set(d, 4.166664568298827e-2f));
  c = hn::MulAdd(hn::Mul(r2, r2), c, hn::NegMulAdd(r2, hn::Set(d, 0.5f), hn::Set(d, 1.0f)));
  // Turn by the quarter: swap for odd quarters, then set signs.
  const DI di;
  const VI q = hn::ConvertTo(di, quarter);
  const MF odd =
      hn::MaskFromVec(hn::BitCast(d, hn::VecFromMask(di, hn::TestBit(q, hn::Set(di, 1)))));
  const auto sign_bit = [&](VI bits) HWY_ATTR {
    return hn::BitCast(d, hn::ShiftLeft<30>(hn::And(bits, hn::Set(di, 2))));
  };
  sine = hn::Xor(hn::IfThenElse(odd, c, s), sign_bit(q));
  cosine = hn::Xor(hn::IfThenElse(odd, s, c), sign_bit(hn::Add(q, hn::Set(di, 1))));
}

/// log((1 + s) / (1 - s)) for |s| < 0.172: its odd series.
HWY_INLINE VF LogRatioSeries(VF s) {
  const DF d;
  const VF s2 = hn::Mul(s, s);
  VF series = hn::MulAdd(s2, hn::Set(d, 2.0f / 7), hn::Set(d, 2.0f / 5));
  series = hn::MulAdd(s2, series, hn::Set(d, 2.0f / 3));
  return hn::Mul(s, hn::MulAdd(s2, series, hn::Set(d, 2.0f)));
}

/// Natural logarithm of normal positive floats: the exponent, and LogRatioSeries for the mantissa;
/// error below 1e-7 relative near 1, 2e-7 absolute elsewhere.
HWY_INLINE VF LogLanes(VF x) {
  const DF d;
  const DI di;
  // x = 2^e m with m in [1/sqrt 2, sqrt 2).
  const VI bits = hn::BitCast(di, x);
  const VI shifted = hn::Sub(bits, hn::Set(di, 0x3F3504F3));
  const VF e = hn::ConvertTo(d, hn::ShiftRight<23>(shifted));
  const VF m =
      hn::BitCast(d, hn::Add(hn::And(shifted, hn::Set(di, 0x007FFFFF)), hn::Set(di, 0x3F3504F3)));
  const VF one = hn::Set(d, 1.0f);
  const VF s = hn::Div(hn::Sub(m, one), hn::Add(m, one));
  return hn::MulAdd(e, hn::Set(d, 0.69314718056f), LogRatioSeries(s));
}

/// log(1 - t) for t in [0, 1], with full relative accuracy near t = 0; large and negative, but
/// finite, at t = 1.
HWY_INLINE VF LogOneMinusLanes(VF t) {
  const DF d;
  const VF one = hn::Set(d, 1.0f);
  // The series of LogLanes with the difference m - 1 = -t as given, not as what rounding leaves of
  // it.
  const VF s = hn::Div(hn::Neg(t), hn::Sub(hn::Set(d, 2.0f), t));
  const VF series = LogRatioSeries(s);
  const MF near_zero = hn::Lt(t, hn::Set(d, 0.25f));
  if (hn::AllTrue(d, near_zero)) return series;
  return hn::IfThenElse(near_zero, series, LogLanes(hn::Max(hn::Sub(one, t), hn::Set(d, 1e-30f))));
}

/// e^x for x in [-87, 88], clamped outside; relative error below 3e-7.
HWY_INLINE VF ExpLanes(VF x) {
  const DF d;
  const VF octaves =
      hn::Mul(hn::Clamp(x, hn::Set(d, -87.0f), hn::Set(d, 88.0f)), hn::Set(d, 1.44269504089f));
  const VF n = hn::Round(octaves);
  const VF f = hn::Mul(hn::Sub(octaves, n), hn::Set(d, 0.69314718056f));
  VF p = hn::MulAdd(f, hn::Set(d, 1.0f / 720), hn::Set(d, 1.0f / 120));
  p = hn::MulAdd(f, p, hn::Set(d, 1.0f / 24));
  p = hn::MulAdd(f, p, hn::Set(d, 1.0f / 6));
  p = hn::MulAdd(f, p, hn::Set(d, 0.5f));
  p = hn::MulAdd(f, p, hn::Set(d, 1.0f));
  p = hn::MulAdd(f, p, hn::Set(d, 1.0f));
  return hn::BitCast(d, hn::Add(hn::BitCast(DI(), p), hn::ShiftLeft<23>(hn::ConvertTo(DI(), n))));
}

/// Minimax polynomial of atan(t)/t in t^2 on [0, 1], highest power first; error of atan 4e-8.
inline constexpr float kAtan[8] = {-4.054394293e-03f, 2.186231616e-02f,  -5.591137602e-02f,
                                   9.642125771e-02f,  -1.390860080e-01f, 1.994655975e-01f,
                                   -3.332986025e-01f, 9.999993354e-01f};

/// atan2(y, x) in (-pi, pi], 0 for (0, 0); minimax polynomial on [0, 1], error below 3e-7.
HWY_INLINE VF Atan2(VF y, VF x) {
  const DF d;
  const VF ax = hn::Abs(x);
  const VF ay = hn::Abs(y);
  const VF big = hn::Max(hn::Max(ax, ay), hn::Set(d, 1e-37f));
  const VF t = hn::Div(hn::Min(ax, ay), big);
  const VF t2 = hn::Mul(t, t);
  VF p = hn::Set(d, kAtan[0]);
  for (int i = 1; i < 8; ++i) p = hn::MulAdd(p, t2, hn::Set(d, kAtan[i]));
  p = hn::Mul(p, t);
  p = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, kPi / 2), p), p);
  p = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, kPi), p), p);
  return hn::CopySign(p, y);
}

/// OctDirection of a unit vector, as encode_octahedral().
HWY_INLINE VU EncodeOctahedral(const Vec3Lanes& w) {
  const DF d;
  const DU du;
  const VF one = hn::Set(d, 1.0f);
  const VF inv = hn::Div(one, hn::Add(hn::Abs(w.x), hn::Add(hn::Abs(w.y), hn::Abs(w.z))));
  const VF u = hn::Mul(w.x, inv);
  const VF v = hn::Mul(w.y, inv);
  const MF below = hn::Lt(w.z, hn::Zero(d));
  const VF fold_u = hn::IfThenElse(below, hn::CopySign(hn::Sub(one, hn::Abs(v)), u), u);
  const VF fold_v = hn::IfThenElse(below, hn::CopySign(hn::Sub(one, hn::Abs(u)), v), v);
  const auto pack = [&](VF t) HWY_ATTR {
    const VF half = hn::Set(d, 0.5f);
    const VF scaled = hn::MulAdd(hn::MulAdd(t, half, half), hn::Set(d, 65535.0f), half);
    return hn::BitCast(du,
                       hn::ConvertTo(DI(), hn::Clamp(scaled, hn::Zero(d), hn::Set(d, 65535.0f))));
  };
  return hn::Or(pack(fold_u), hn::ShiftLeft<16>(pack(fold_v)));
}

/// Unit vector of an OctDirection, as decode_octahedral().
HWY_INLINE Vec3Lanes DecodeOctahedral(VU code) {
  const DF d;
  const DI di;
  const VF one = hn::Set(d, 1.0f);
  const auto unpack = [&](VU bits) HWY_ATTR {
    return hn::MulAdd(hn::ConvertTo(d, hn::BitCast(di, bits)), hn::Set(d, 2.0f / 65535.0f),
                      hn::Set(d, -1.0f));
  };
  const VF u = unpack(hn::And(code, hn::Set(DU(), 0xFFFFu)));
  const VF v = unpack(hn::ShiftRight<16>(code));
  const VF z = hn::Sub(hn::Sub(one, hn::Abs(u)), hn::Abs(v));
  const VF fold = hn::Max(hn::Neg(z), hn::Zero(d));
  const Vec3Lanes w{hn::Sub(u, hn::CopySign(fold, u)), hn::Sub(v, hn::CopySign(fold, v)), z};
  return Scale(w, InverseSqrt(Dot(w, w)));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
