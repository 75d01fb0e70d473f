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
#include "worker/surface/environment_view.h"

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

/// Where the texels of every lane begin.
HWY_INLINE Records TexelRecords(const EnvironmentView& view, VI index) {
  HWY_ALIGN std::int32_t offset[hn::MaxLanes(DI())];
  hn::Store(hn::ShiftLeft<2>(index), DI(), offset);
  Records texels;
  for (std::size_t lane = 0; lane < hn::Lanes(DI()); ++lane) {
    texels[lane] = view.texels + offset[lane];
  }
  return texels;
}

/// One texel per lane, unfiltered.
HWY_INLINE RadianceLanes LoadTexels(const EnvironmentView& view, VI index) {
  const FourRows texel = LoadFour(TexelRecords(view, index), 0);
  return {texel.row[0], texel.row[1], texel.row[2], texel.row[3]};
}

/// Four texels of lanes k, k + 4, ... weighted bilinearly; the sign of the fourth float is the
/// upper left one's.
template <int k>
HWY_INLINE VF BlendBlocks(const Records& upper, const Records& lower, VF fx, VF fy) {
  const DF d;
  const VF x = hn::Broadcast<k>(fx);
  const VF y = hn::Broadcast<k>(fy);
  const VF corner = LoadBlocks(d, &upper[k], 0);
  const VF upper_left = hn::Abs(corner), upper_right = hn::Abs(LoadBlocks(d, &upper[k], 4));
  const VF lower_left = hn::Abs(LoadBlocks(d, &lower[k], 0));
  const VF lower_right = hn::Abs(LoadBlocks(d, &lower[k], 4));
  const VF top = hn::MulAdd(x, hn::Sub(upper_right, upper_left), upper_left);
  const VF bottom = hn::MulAdd(x, hn::Sub(lower_right, lower_left), lower_left);
  return hn::CopySign(hn::MulAdd(y, hn::Sub(bottom, top), top), corner);
}

/// Four texels per lane, weighted bilinearly; the sign of the density is the upper left texel's.
HWY_INLINE RadianceLanes LoadTexelsBilinear(const EnvironmentView& view, VI index, VF fx, VF fy) {
  const Records upper = TexelRecords(view, index);
  Records lower;
  for (std::size_t lane = 0; lane < hn::Lanes(DF()); ++lane) {
    lower[lane] = upper[lane] + 4 * static_cast<std::ptrdiff_t>(view.stride);
  }
  const FourRows texel =
      TransposeBlocks(BlendBlocks<0>(upper, lower, fx, fy), BlendBlocks<1>(upper, lower, fx, fy),
                      BlendBlocks<2>(upper, lower, fx, fy), BlendBlocks<3>(upper, lower, fx, fy));
  return {texel.row[0], texel.row[1], texel.row[2], texel.row[3]};
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

/// As the camera sees them.
HWY_INLINE RadianceLanes SeenTexels(const EnvironmentView& view, const TexelLanes& at) {
  if (!view.bilinear) return LoadTexels(view, at.index);
  return LoadTexelsBilinear(view, at.index, at.fx, at.fy);
}

/// As they light surfaces: what is hidden does not.
HWY_INLINE RadianceLanes EvaluateTexels(const EnvironmentView& view, const TexelLanes& at) {
  const DF d;
  const DI di;
  RadianceLanes light = SeenTexels(view, at);
  const VF hidden = hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(di, light.density)));
  light.r = hn::AndNot(hidden, light.r);
  light.g = hn::AndNot(hidden, light.g);
  light.b = hn::AndNot(hidden, light.b);
  light.density = hn::AndNot(hidden, light.density);
  return light;
}

/// Radiance that lights surfaces and density along unit world directions.
HWY_INLINE RadianceLanes EvaluateEnvironment(const EnvironmentView& view, const Vec3Lanes& world) {
  return EvaluateTexels(view, LocateTexels(view, world));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
