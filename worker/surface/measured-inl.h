// Measured BRDFs in SIMD: MeasuredBrdf::evaluate for a vector of (site, direction) pairs. Included
// once per Highway target.
#if defined(BATON_WORKER_SCENE_MEASURED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SCENE_MEASURED_INL_H_
#undef BATON_WORKER_SCENE_MEASURED_INL_H_
#else
#define BATON_WORKER_SCENE_MEASURED_INL_H_
#endif

#include <hwy/highway.h>

#include "common/math/lanes-inl.h"
#include "common/scene/material/measured_brdf.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE Vec3Lanes Cross(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

/// Indices of two neighbours and the weight of the second.
struct NeighbourLanes {
  VI first, second;
  VF mix;
};
/// x: position in cells, centres at .5; held at both ends.
HWY_INLINE NeighbourLanes ClampedNeighbours(VF x, int count) {
  const DF d;
  const DI di;
  const VF at = hn::Clamp(hn::Sub(x, hn::Set(d, 0.5f)), hn::Zero(d),
                          hn::Set(d, static_cast<float>(count - 1)));
  const VI first = hn::Min(hn::ConvertTo(di, at), hn::Set(di, count - 2));
  return {first, hn::Add(first, hn::Set(di, 1)), hn::Sub(at, hn::ConvertTo(d, first))};
}
/// The same on a ring; x in [0, count].
HWY_INLINE NeighbourLanes WrappedNeighbours(VF x, int count) {
  const DF d;
  const DI di;
  const VF at = hn::Sub(x, hn::Set(d, 0.5f));
  const VF floor = hn::Floor(at);
  const VI below = hn::ConvertTo(di, floor);
  const VI last = hn::Set(di, count - 1);
  const VI next = hn::Add(below, hn::Set(di, 1));
  return {hn::IfThenElse(hn::Lt(below, hn::Zero(di)), last, below),
          hn::IfThenElse(hn::Gt(next, last), hn::Zero(di), next), hn::Sub(at, floor)};
}

/// f(wi, wo) of tables[table] per lane, without the cosine; 0 where that is null; lanes below the
/// horizon hold any finite value.
HWY_INLINE Vec3Lanes EvaluateMeasured(const float* const* tables, VI table, const Vec3Lanes& n,
                                      const Vec3Lanes& wi, const Vec3Lanes& wo) {
  const DF d;
  const DI di;
  const hn::FixedTag<float, 4> d4;
  using Table = MeasuredBrdf;

  // Angles, as in the scalar code.
  const Vec3Lanes sum = Add(wi, wo);
  const Vec3Lanes h = Scale(sum, InverseSqrt(hn::Max(Dot(sum, sum), hn::Set(d, 1e-20f))));
  const Vec3Lanes n_cross_h = Cross(n, h);
  const Vec3Lanes wi_cross_h = Cross(wi, h);
  const VF n_h = Dot(n, h);
  const VF wi_h = Dot(wi, h);
  const VF theta_h = Atan2(hn::Sqrt(Dot(n_cross_h, n_cross_h)), n_h);
  const VF theta_d = Atan2(hn::Sqrt(Dot(wi_cross_h, wi_cross_h)), wi_h);
  const VF turned = Atan2(Dot(wi, n_cross_h), hn::MulSub(n_h, wi_h, Dot(wi, n)));
  const VF phi_d =
      hn::IfThenElse(hn::Lt(turned, hn::Zero(d)), hn::Add(turned, hn::Set(d, kPi)), turned);

  // The eight neighbours: offsets of their texels and the three weights.
  const NeighbourLanes rows =
      ClampedNeighbours(hn::Mul(hn::Sqrt(hn::Mul(theta_h, hn::Set(d, 2 * kInvPi))),
                                hn::Set(d, float{Table::kThetaH})),
                        Table::kThetaH);
  const NeighbourLanes columns =
      ClampedNeighbours(hn::Mul(theta_d, hn::Set(d, 2 * kInvPi * Table::kThetaD)), Table::kThetaD);
  const NeighbourLanes ring = WrappedNeighbours(
      hn::Min(hn::Mul(phi_d, hn::Set(d, kInvPi * Table::kPhiD)), hn::Set(d, float{Table::kPhiD})),
      Table::kPhiD);
  HWY_ALIGN std::int32_t offset[8][hn::MaxLanes(DI())];
  for (int corner = 0; corner < 8; ++corner) {
    const VI row = (corner & 1) != 0 ? rows.second : rows.first;
    const VI column = (corner & 2) != 0 ? columns.second : columns.first;
    const VI place = (corner & 4) != 0 ? ring.second : ring.first;
    const VI entry = hn::Add(hn::Mul(hn::Add(hn::Mul(row, hn::Set(di, Table::kThetaD)), column),
                                     hn::Set(di, Table::kPhiD)),
                             place);
    hn::Store(hn::ShiftLeft<2>(entry), di, offset[corner]);
  }
  HWY_ALIGN float mix[3][hn::MaxLanes(DF())];
  hn::Store(rows.mix, d, mix[0]);
  hn::Store(columns.mix, d, mix[1]);
  hn::Store(ring.mix, d, mix[2]);
  HWY_ALIGN std::int32_t table_of[hn::MaxLanes(DI())];
  hn::Store(table, di, table_of);

  // Interpolate lane by lane, all channels of a texel at once.
  HWY_ALIGN float texels[4 * hn::MaxLanes(DF())];
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    const float* const table_texels = tables[table_of[lane]];
    if (table_texels == nullptr) {
      hn::Store(hn::Zero(d4), d4, texels + 4 * lane);
      continue;
    }
    const auto load = [&](int corner)
                          HWY_ATTR { return hn::LoadU(d4, table_texels + offset[corner][lane]); };
    const auto blend = [&](auto a, auto b, int axis) HWY_ATTR {
      return hn::MulAdd(hn::Set(d4, mix[axis][lane]), hn::Sub(b, a), a);
    };
    const auto near = blend(blend(load(0), load(1), 0), blend(load(2), load(3), 0), 1);
    const auto far = blend(blend(load(4), load(5), 0), blend(load(6), load(7), 0), 1);
    hn::Store(blend(near, far, 2), d4, texels + 4 * lane);
  }
  Vec3Lanes f;
  VF pad;
  hn::LoadInterleaved4(d, texels, f.x, f.y, f.z, pad);
  return f;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
