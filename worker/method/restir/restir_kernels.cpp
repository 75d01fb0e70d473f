#include "worker/method/restir/restir_kernels.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/restir/restir_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/method/carried/carried_light.h"
#include "worker/surface/bsdf-inl.h"
#include "worker/surface/environment-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Which lights a range is evaluated under.
struct WantedLights {
  bool now, before;
};

/// Turns back what `turn`, if there is one, has turned.
HWY_INLINE Vec3Lanes TurnBack(const Mat3* turn, const Vec3Lanes& w) {
  if (turn == nullptr) return w;
  return Transform(turn->transposed().m.data(), w);
}

/// A vector of points and where they lie in the maps.
struct PlacedPoints {
  VI site;
  Vec3Lanes w;
  /// Where carried samples at w came from: w, or turned back with the map.
  Vec3Lanes w_before;
  TexelLanes now, before;
};
HWY_INLINE PlacedPoints PlacePoints(const kernels::RestirPoints& points, std::size_t i,
                                    const kernels::CarriedLight& light,
                                    const WantedLights& wanted) {
  PlacedPoints p;
  p.site = hn::PromoteTo(DI(), hn::LoadU(DB(), points.site.from(i)));
  p.w = DecodeOctahedral(hn::LoadU(DU(), points.code.from(i)));
  p.w_before = TurnBack(light.turn, p.w);
  if (wanted.now) {
    p.now = LocateTexels(light.now, p.w);
    PrefetchTexels(light.now, p.now);
  }
  if (wanted.before) {
    p.before = LocateTexels(light.before, p.w);
    PrefetchTexels(light.before, p.before);
  }
  return p;
}

/// The target under the surfaces that a carried set comes from.
HWY_INLINE VF OldTarget(const OldSurfaces& old, std::int32_t num_sites, const PlacedPoints& p,
                        const RadianceLanes& then) {
  const SurfaceLanes surface = LoadSurfaces(old.sites, p.site);
  const BsdfLanes f = EvaluateBsdf(surface, p.w_before);
  const VF target = MeanLanes(ReflectedRadiance(surface, f, then.r, then.g, then.b));
  return hn::Mul(target, ExpLanes(LookUp(old.log_share, p.site, num_sites)));
}

void EvaluatePoints(const SiteBlock& sites, std::span<const OldSurfaces* const> old,
                    const kernels::CarriedLight& light, const kernels::PointRange& range,
                    kernels::RestirPoints& points) {
  const DF d;
  const bool wants_old = range.first_old < old.size();
  const bool same_light = light.still || light.turn != nullptr;
  const WantedLights wanted{range.wants_now || (wants_old && same_light), wants_old && !same_light};
  const bool wants_surface =
      range.wants_now ||
      std::any_of(old.begin() + static_cast<std::ptrdiff_t>(range.first_old), old.end(),
                  [](const OldSurfaces* surfaces) { return surfaces == nullptr; });

  const auto put = [&](VF value, kernels::RestirPoints::Column<float>& column, std::size_t i)
                       HWY_ATTR { StoreSome(value, column.first(range.last), i); };

  // A few vectors at a time: the texels of all are prefetched before the first is evaluated.
  constexpr std::size_t kAhead = 8;
  PlacedPoints placed[kAhead];
  for (std::size_t first = range.first; first < range.last; first += kAhead * hn::Lanes(d)) {
    const std::size_t last = std::min(range.last, first + kAhead * hn::Lanes(d));
    for (std::size_t i = first; i < last; i += hn::Lanes(d))
      placed[(i - first) / hn::Lanes(d)] = PlacePoints(points, i, light, wanted);

    for (std::size_t i = first; i < last; i += hn::Lanes(d)) {
      const PlacedPoints& p = placed[(i - first) / hn::Lanes(d)];
      SurfaceLanes surface;
      BsdfLanes f;
      RadianceLanes now, then;
      if (wants_surface) {
        surface = LoadSurfaces(sites, p.site);
        f = EvaluateBsdf(surface, p.w);
      }
      if (wanted.now) now = EvaluateTexels(light.now, p.now);
      if (range.wants_now) {
        const Vec3Lanes reflected = ReflectedRadiance(surface, f, now.r, now.g, now.b);
        put(reflected.x, points.r, i);
        put(reflected.y, points.g, i);
        put(reflected.z, points.b, i);
        put(MeanLanes(reflected), points.target_now, i);
      }
      if (!wants_old) continue;
      then = same_light ? now : EvaluateTexels(light.before, p.before);
      for (std::size_t k = range.first_old; k < old.size(); ++k) {
        if (old[k] != nullptr) {
          put(OldTarget(*old[k], sites.num_sites, p, then), points.target_before[k], i);
          continue;
        }
        if (light.turn != nullptr) f = EvaluateBsdf(surface, p.w_before);
        put(MeanLanes(ReflectedRadiance(surface, f, then.r, then.g, then.b)),
            points.target_before[k], i);
      }
    }
  }
}

void TurnPoints(const Mat3& turn, std::size_t first, std::size_t last,
                kernels::RestirPoints& points) {
  const DU du;
  for (std::size_t i = first; i < last; i += hn::Lanes(du)) {
    const Vec3Lanes w = DecodeOctahedral(hn::LoadU(du, points.code.from(i)));
    const VU turned = EncodeOctahedral(Transform(turn.m.data(), w));
    StoreSome(du, turned, points.code.first(last), i);
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(EvaluatePoints);
HWY_EXPORT(TurnPoints);

namespace kernels {

void turn_points(const Mat3& turn, std::size_t first, std::size_t last, RestirPoints& points) {
  BATON_CHECK(last <= RestirPoints::kMost);
  HWY_DYNAMIC_DISPATCH(TurnPoints)(turn, first, last, points);
}

void evaluate_points(const SiteBlock& sites, std::span<const OldSurfaces* const> old,
                     const CarriedLight& light, const PointRange& range, RestirPoints& points) {
  BATON_CHECK(old.size() < kMaxRestirSets && range.first_old <= old.size());
  BATON_CHECK(range.last <= RestirPoints::kMost);
  HWY_DYNAMIC_DISPATCH(EvaluatePoints)(sites, old, light, range, points);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
