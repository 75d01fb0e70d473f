// The functions of common/math/vec3.h for vectors of directions, product by product and sum by sum:
// results are the same on all instruction sets, and those of the scalar functions. Included once
// per Highway target.
#if defined(BATON_COMMON_MATH_EXACT_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_COMMON_MATH_EXACT_LANES_INL_H_
#undef BATON_COMMON_MATH_EXACT_LANES_INL_H_
#else
#define BATON_COMMON_MATH_EXACT_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include "common/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE Vec3Lanes SetLanes(const Vec3& v) {
  return {hn::Set(DF(), v.x), hn::Set(DF(), v.y), hn::Set(DF(), v.z)};
}
HWY_INLINE Vec3Lanes Sub(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE VF ExactDot(const Vec3Lanes& a, const Vec3Lanes& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vec3Lanes ExactCross(const Vec3Lanes& a, const Vec3Lanes& b) {
  const auto minor = [](VF a0, VF b1, VF a1, VF b0)
                         HWY_ATTR { return hn::Sub(hn::Mul(a0, b1), hn::Mul(a1, b0)); };
  return {minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}
HWY_INLINE Vec3Lanes ExactTimes(const Mat3& m, const Vec3Lanes& v) {
  return {ExactDot(SetLanes({m.m[0], m.m[1], m.m[2]}), v),
          ExactDot(SetLanes({m.m[3], m.m[4], m.m[5]}), v),
          ExactDot(SetLanes({m.m[6], m.m[7], m.m[8]}), v)};
}
HWY_INLINE Vec3Lanes ExactNormalize(const Vec3Lanes& v) {
  const DF d;
  const VF length = hn::Sqrt(ExactDot(v, v));
  const MF is_usual = hn::And(hn::Gt(length, hn::Zero(d)), hn::Lt(length, hn::Inf(d)));
  return Select(is_usual, {hn::Div(v.x, length), hn::Div(v.y, length), hn::Div(v.z, length)},
                SetLanes({0, 0, 1}));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
