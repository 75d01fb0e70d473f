// The targets of two frames of a pixel for the sequential sampler, in SIMD: where materials meet
// light. Included once per Highway target.
#if defined(BATON_WORKER_METHOD_SEQUENTIAL_CARRIED_TARGET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_METHOD_SEQUENTIAL_CARRIED_TARGET_INL_H_
#undef BATON_WORKER_METHOD_SEQUENTIAL_CARRIED_TARGET_INL_H_
#else
#define BATON_WORKER_METHOD_SEQUENTIAL_CARRIED_TARGET_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "worker/light/presampled_light-inl.h"
#include "worker/method/carried/carried_light.h"
#include "worker/method/carried/old_surfaces.h"
#include "worker/sampling/sequential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Site of the k-th surface of the pixel, k = floor(fraction * num_hits); fraction in [0, 1).
HWY_INLINE VI SiteAt(const SiteBlock& block, VF fraction) {
  const DF d;
  const DI di;
  const VI k =
      hn::Min(hn::ConvertTo(di, hn::Mul(fraction, hn::Set(d, static_cast<float>(block.num_hits)))),
              hn::Set(di, block.num_hits - 1));
  if (block.num_hits == block.num_sites) return k;
  return hn::GatherIndex(di, block.hit_sites.data(), k);
}

/// Directions i, i + 1, ... of those that were located ahead, and the light from there.
HWY_INLINE Vec3Lanes LocatedDirection(const kernels::LocatedDirections& at, std::size_t i) {
  const DF d;
  return {hn::Load(d, at.x.from(i)), hn::Load(d, at.y.from(i)), hn::Load(d, at.z.from(i))};
}
HWY_INLINE RadianceLanes LocatedLight(const EnvironmentView& view,
                                      const kernels::LocatedDirections::Place& at, std::size_t i) {
  const DF d;
  return EvaluateTexels(view, {hn::Load(DI(), at.texel.from(i)), hn::Load(d, at.right.from(i)),
                               hn::Load(d, at.down.from(i))});
}

/// The targets of two frames for SequentialStep, as far as they do not depend on which surfaces the
/// frame before saw. The factor 1/S is common to all points and left out. Independent proposals
/// come from the presampled light, with the site uniform among those that see a surface. Surface:
/// has LogTargetBefore(site, w, surface and BRDF of now, light of then), the log of the target of
/// the frame before.
template <class Surface>
struct CarriedTarget {
  const SiteBlock& sites;
  const kernels::CarriedLight& light;
  const kernels::LocatedDirections* located;  ///< the carried particles, or null

  /// Sets `out` for `point`, log_before only where it is wanted.
  HWY_INLINE void Evaluate(const PointLanes& point, bool want_before, TargetLanes& out) const {
    const Vec3Lanes w = DecodeOctahedral(point.code);
    const RadianceLanes now = EvaluateEnvironment(light.now, w);
    const auto then = [&]() HWY_ATTR { return EvaluateEnvironment(light.before, w); };
    SetTargets(point.site, w, now, InverseOrZero(now.density), want_before, then, out);
  }

  /// As Evaluate, for the carried particles i, i + 1, ...
  HWY_INLINE void EvaluateCarried(std::size_t i, const PointLanes& point, bool want_before,
                                  TargetLanes& out) const {
    if (located == nullptr) return Evaluate(point, want_before, out);
    const Vec3Lanes w = LocatedDirection(*located, i);
    const RadianceLanes now = LocatedLight(light.now, located->now, i);
    const auto then = [&]() HWY_ATTR {
      if (located->has_before) return LocatedLight(light.before, located->before, i);
      return EvaluateEnvironment(light.before, w);
    };
    SetTargets(point.site, w, now, InverseOrZero(now.density), want_before, then, out);
  }

  bool ManySites() const { return sites.num_hits > 1; }

  /// Brings the block of proposals that BlockStart(bits) will name into the cache.
  HWY_INLINE void Prefetch(std::uint32_t bits) const {
    const std::size_t number = BlockStart(bits) / PresampledLight::kBlock;
    const auto fetch = [](const auto& part) {
      for (std::size_t line = 0; line < sizeof(part); line += 64)
        hwy::Prefetch(reinterpret_cast<const char*>(&part) + line);
    };
    fetch(light.presampled.blocks[number]);
    fetch(light.presampled.before[number]);
  }

  /// First entry of a uniformly drawn block of proposals.
  static std::size_t BlockStart(std::uint32_t bits) {
    static_assert(PresampledLight::kBlock == kProposalBlock &&
                  (PresampledLight::kSize & (PresampledLight::kSize - 1)) == 0);
    return bits & (PresampledLight::kSize - PresampledLight::kBlock);
  }

  /// Draws `point` from the presampled light's entries entry, entry + 1, ... and sets `out`,
  /// log_before only where it is wanted.
  HWY_INLINE void Propose(std::size_t entry, VF site_fraction, bool want_before, PointLanes& point,
                          TargetLanes& out) const {
    const LightLanes from = LoadLight(light.presampled, entry);
    point.code = from.code;
    point.site = SiteAt(sites, site_fraction);
    const auto then = [&]() HWY_ATTR {
      const Vec3Lanes before = LoadLightBefore(light.presampled, entry);
      return RadianceLanes{before.x, before.y, before.z, from.now.density};
    };
    SetTargets(point.site, from.direction, from.now, from.inverse_density, want_before, then, out);
  }

 private:
  /// then(): the light of the frame before. (Members one by one: SetZero.)
  template <class Then>
  HWY_INLINE void SetTargets(VI site, const Vec3Lanes& w, const RadianceLanes& now,
                             VF inverse_density, bool want_before, const Then& then,
                             TargetLanes& out) const {
    const SurfaceLanes surface = LoadSurfaces(sites, site);
    const BsdfLanes f = EvaluateBsdf(surface, w);
    const Vec3Lanes reflected = ReflectedRadiance(surface, f, now.r, now.g, now.b);
    out.reflected.x = reflected.x;
    out.reflected.y = reflected.y;
    out.reflected.z = reflected.z;
    out.log_now = LogOrZero(MeanLanes(reflected));
    out.density = now.density;
    out.inverse_density = inverse_density;
    out.log_before = hn::Zero(DF());
    if (!want_before) return;
    out.log_before =
        static_cast<const Surface*>(this)->LogTargetBefore(site, w, surface, f, then());
  }
};

/// Surfaces that stay.
struct SameSurfaceTarget : CarriedTarget<SameSurfaceTarget> {
  HWY_INLINE VF LogTargetBefore(VI /*site*/, const Vec3Lanes& /*w*/, const SurfaceLanes& surface,
                                const BsdfLanes& f, const RadianceLanes& then) const {
    return LogOrZero(MeanLanes(ReflectedRadiance(surface, f, then.r, then.g, then.b)));
  }
};

/// Surfaces that differ: those of the frame before are seen through the sites that inherit them.
struct MovedSurfaceTarget : CarriedTarget<MovedSurfaceTarget> {
  const OldSurfaces& old;

  HWY_INLINE VF LogTargetBefore(VI site, const Vec3Lanes& w, const SurfaceLanes& /*now*/,
                                const BsdfLanes& /*f*/, const RadianceLanes& then) const {
    const SurfaceLanes surface = LoadSurfaces(old.sites, site);
    const BsdfLanes f = EvaluateBsdf(surface, w);
    return hn::Add(LogOrZero(MeanLanes(ReflectedRadiance(surface, f, then.r, then.g, then.b))),
                   LookUp(old.log_share, site, sites.num_sites));
  }
};

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
