// Environment look-ups in SIMD: EnvironmentMap::evaluate for a vector of directions. Included once
// per Highway target.
#if defined(BATON_WORKER_SCENE_ENVIRONMENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SCENE_ENVIRONMENT_INL_H_
#undef BATON_WORKER_SCENE_ENVIRONMENT_INL_H_
#else
#define BATON_WORKER_SCENE_ENVIRONMENT_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "common/math/lanes-inl.h"
#include "worker/scene/environment_view.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Radiance and the sampling table's density (1/sr) per lane.
struct RadianceLanes {
  VF r, g, b, density;
};

/// Position in texels of world directions: x in [0, W], y in [0, H].
HWY_INLINE void MapPosition(const EnvironmentView& view, const Vec3Lanes& world, VF& x, VF& y) {
  const DF d;
  const Vec3Lanes w = Transform(view.to_map.data(), world);
  const VF longitude = Atan2(w.x, w.z);
  const VF polar = Atan2(hn::Sqrt(hn::MulAdd(w.x, w.x, hn::Mul(w.z, w.z))), w.y);
  x = hn::MulAdd(longitude, hn::Set(d, -0.5f * kInvPi * static_cast<float>(view.width)),
                 hn::Set(d, 0.5f * static_cast<float>(view.width)));
  y = hn::Mul(polar, hn::Set(d, kInvPi * static_cast<float>(view.height)));
}

/// Index of texel (i, j) in the padded array, i in [-1, W], j in [-1, H].
HWY_INLINE VI TexelIndex(const EnvironmentView& view, VI i, VI j) {
  const DI di;
  const VI one = hn::Set(di, 1);
  return hn::Add(hn::Mul(hn::Add(j, one), hn::Set(di, view.stride)), hn::Add(i, one));
}

/// One texel per lane, unfiltered.
HWY_INLINE RadianceLanes LoadTexels(const EnvironmentView& view, VI index) {
  const DF d;
  const DI di;
  const hn::FixedTag<float, 4> d4;
  HWY_ALIGN std::int32_t offsets[hn::MaxLanes(DI())];
  HWY_ALIGN float rows[4 * hn::MaxLanes(DF())];
  hn::Store(hn::ShiftLeft<2>(index), di, offsets);
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    hn::Store(hn::LoadU(d4, view.texels + offsets[lane]), d4, rows + 4 * lane);
  }
  RadianceLanes out;
  hn::LoadInterleaved4(d, rows, out.r, out.g, out.b, out.density);
  return out;
}

/// Four texels per lane, weighted bilinearly; the density is the upper left texel's.
HWY_INLINE RadianceLanes LoadTexelsBilinear(const EnvironmentView& view, VI index, VF fx, VF fy) {
  const DF d;
  const DI di;
  const hn::FixedTag<float, 4> d4;
  HWY_ALIGN std::int32_t offsets[hn::MaxLanes(DI())];
  HWY_ALIGN float wx[hn::MaxLanes(DF())], wy[hn::MaxLanes(DF())], rows[4 * hn::MaxLanes(DF())];
  hn::Store(hn::ShiftLeft<2>(index), di, offsets);
  hn::Store(fx, d, wx);
  hn::Store(fy, d, wy);
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    const float* upper = view.texels + offsets[lane];
    const float* lower = upper + 4 * view.stride;
    const auto x = hn::Set(d4, wx[lane]);
    const auto upper_left = hn::LoadU(d4, upper);
    const auto lower_left = hn::LoadU(d4, lower);
    const auto top = hn::MulAdd(x, hn::Sub(hn::LoadU(d4, upper + 4), upper_left), upper_left);
    const auto bottom = hn::MulAdd(x, hn::Sub(hn::LoadU(d4, lower + 4), lower_left), lower_left);
    hn::Store(hn::MulAdd(hn::Set(d4, wy[lane]), hn::Sub(bottom, top), top), d4, rows + 4 * lane);
  }
  RadianceLanes out;
  hn::LoadInterleaved4(d, rows, out.r, out.g, out.b, out.density);
  out.density = hn::GatherIndex(d, view.texels + 3, hn::ShiftLeft<2>(index));
  return out;
}

/// Where a look-up reads: the upper left texel, and with a bilinear map how far it is into the
/// cell.
struct TexelLanes {
  VI index;
  VF fx, fy;
};

/// The texels along unit world directions.
HWY_INLINE TexelLanes LocateTexels(const EnvironmentView& view, const Vec3Lanes& world) {
  const DF d;
  const DI di;
  VF x, y;
  MapPosition(view, world, x, y);
  if (!view.bilinear) {
    const VI i = hn::Min(hn::ConvertTo(di, x), hn::Set(di, view.width - 1));
    const VI j = hn::Min(hn::ConvertTo(di, y), hn::Set(di, view.height - 1));
    return {TexelIndex(view, hn::Max(i, hn::Zero(di)), hn::Max(j, hn::Zero(di))), hn::Zero(d),
            hn::Zero(d)};
  }
  const VF half = hn::Set(d, 0.5f);
  const VF minus_half = hn::Set(d, -0.5f);
  x = hn::Clamp(hn::Sub(x, half), minus_half, hn::Set(d, static_cast<float>(view.width) - 0.5f));
  y = hn::Clamp(hn::Sub(y, half), minus_half, hn::Set(d, static_cast<float>(view.height) - 0.5f));
  const VF floor_x = hn::Floor(x);
  const VF floor_y = hn::Floor(y);
  const VI i = hn::Min(hn::ConvertTo(di, floor_x), hn::Set(di, view.width - 1));
  const VI j = hn::Min(hn::ConvertTo(di, floor_y), hn::Set(di, view.height - 1));
  return {TexelIndex(view, i, j), hn::Sub(x, floor_x), hn::Sub(y, floor_y)};
}

/// Asks for the texels early: a map is larger than the caches.
HWY_INLINE void PrefetchTexels(const EnvironmentView& view, const TexelLanes& at) {
  HWY_ALIGN std::int32_t index[hn::MaxLanes(DI())];
  hn::Store(at.index, DI(), index);
  for (std::size_t lane = 0; lane < hn::Lanes(DI()); ++lane) {
    const float* upper = view.texels + 4 * static_cast<std::ptrdiff_t>(index[lane]);
    hwy::Prefetch(upper);
    if (view.bilinear) hwy::Prefetch(upper + 4 * view.stride);
  }
}

HWY_INLINE RadianceLanes EvaluateTexels(const EnvironmentView& view, const TexelLanes& at) {
  if (!view.bilinear) return LoadTexels(view, at.index);
  return LoadTexelsBilinear(view, at.index, at.fx, at.fy);
}

/// Radiance and density along unit world directions.
HWY_INLINE RadianceLanes EvaluateEnvironment(const EnvironmentView& view, const Vec3Lanes& world) {
  return EvaluateTexels(view, LocateTexels(view, world));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
