// The product target of a pixel in SIMD: where materials meet light. Included once per Highway target.
#if defined(BATON_WORKER_INTEGRATOR_TARGET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_INTEGRATOR_TARGET_INL_H_
#undef BATON_WORKER_INTEGRATOR_TARGET_INL_H_
#else
#define BATON_WORKER_INTEGRATOR_TARGET_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "worker/integrator/light_pool.h"
#include "worker/integrator/old_surfaces.h"
#include "worker/sampling/sequential-inl.h"
#include "worker/scene/bsdf-inl.h"
#include "worker/scene/environment-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Reflected radiance (f cos L) per channel.
HWY_INLINE Vec3Lanes ReflectedRadiance(const SurfaceLanes& s, const BsdfLanes& f, VF r, VF g, VF b) {
  if (!s.any_lobe) {
    const VF each = hn::Mul(f.cosine, hn::Set(DF(), kInvPi));
    return {hn::Mul(hn::Mul(s.kd.x, each), r), hn::Mul(hn::Mul(s.kd.y, each), g),
            hn::Mul(hn::Mul(s.kd.z, each), b)};
  }
  const auto channel = [&](VF kd, VF ks, VF radiance) HWY_ATTR {
    return hn::Mul(hn::Mul(hn::MulAdd(f.diffuse, kd, hn::MulAdd(f.lobe, ks, f.white)), f.cosine), radiance);
  };
  const Vec3Lanes reflected{channel(s.kd.x, s.ks.x, r), channel(s.kd.y, s.ks.y, g), channel(s.kd.z, s.ks.z, b)};
  if (!s.any_measured) return reflected;
  const auto tabulated = [&](VF value, VF radiance) HWY_ATTR { return hn::Mul(hn::Mul(value, f.cosine), radiance); };
  return Add(reflected, {tabulated(f.measured.x, r), tabulated(f.measured.y, g), tabulated(f.measured.z, b)});
}

/// A vector of entries of the light pool.
struct LightLanes {
  VU code;
  Vec3Lanes direction;
  RadianceLanes now;
};
/// Entries entry, entry + 1, ..., which lie in one block.
HWY_INLINE LightLanes LoadLight(const LightPool& pool, std::size_t entry) {
  const DF d;
  const LightPool::Block& block = pool.blocks[entry / LightPool::kBlock];
  const std::size_t at = entry % LightPool::kBlock;
  return {hn::Load(DU(), block.code + at),
          {hn::Load(d, block.x + at), hn::Load(d, block.y + at), hn::Load(d, block.z + at)},
          {hn::Load(d, block.r + at), hn::Load(d, block.g + at), hn::Load(d, block.b + at),
           hn::Load(d, block.density + at)}};
}
/// Radiance of the same entries in the frame before.
HWY_INLINE Vec3Lanes LoadLightBefore(const LightPool& pool, std::size_t entry) {
  const DF d;
  const LightPool::Block& block = pool.blocks[entry / LightPool::kBlock];
  const std::size_t at = entry % LightPool::kBlock;
  return {hn::Load(d, block.before_r + at), hn::Load(d, block.before_g + at),
          hn::Load(d, block.before_b + at)};
}

/// Site of the k-th surface of the pixel, k = floor(fraction * num_hits); fraction in [0, 1).
HWY_INLINE VI SiteAt(const SiteBlock& block, VF fraction) {
  const DF d;
  const DI di;
  const VI k = hn::Min(hn::ConvertTo(di, hn::Mul(fraction, hn::Set(d, static_cast<float>(block.num_hits)))),
                       hn::Set(di, block.num_hits - 1));
  if (block.num_hits == block.num_sites) return k;
  return hn::GatherIndex(di, block.hit_sites.data(), k);
}

/// LogTargets from what is reflected and the proposal's density.
HWY_INLINE LogTargets TargetsOf(VF log_before, const Vec3Lanes& reflected, VF density) {
  return {log_before, LogOrZero(MeanLanes(reflected)), LogOrZero(density), reflected};
}

/// The targets of two frames whose surfaces are the same, for SequentialStep. The factor 1/S is common to all points and
/// left out. Independent proposals come from the light pool, with the site uniform among those that see a surface.
struct SameSurfaceTarget {
  const SiteBlock& sites;
  const EnvironmentView& before;
  const EnvironmentView& now;
  const LightPool& pool;

  HWY_INLINE LogTargets Evaluate(const PointLanes& point) const {
    const Vec3Lanes w = DecodeOctahedral(point.code);
    const SurfaceLanes surface = LoadSurfaces(sites, point.site);
    const BsdfLanes f = EvaluateBsdf(surface, w);
    const RadianceLanes then = EvaluateEnvironment(before, w);
    const RadianceLanes light = EvaluateEnvironment(now, w);
    return TargetsOf(LogOrZero(MeanLanes(ReflectedRadiance(surface, f, then.r, then.g, then.b))),
                     ReflectedRadiance(surface, f, light.r, light.g, light.b), light.density);
  }

  /// As Evaluate, but `before` is left 0.
  HWY_INLINE LogTargets EvaluateNow(const PointLanes& point) const {
    const Vec3Lanes w = DecodeOctahedral(point.code);
    const SurfaceLanes surface = LoadSurfaces(sites, point.site);
    const RadianceLanes light = EvaluateEnvironment(now, w);
    const Vec3Lanes reflected = ReflectedRadiance(surface, EvaluateBsdf(surface, w), light.r, light.g, light.b);
    return TargetsOf(hn::Zero(DF()), reflected, light.density);
  }

  bool ManySites() const { return sites.num_hits > 1; }

  /// Brings the block of proposals that BlockStart(bits) will name into the cache.
  HWY_INLINE void Prefetch(std::uint32_t bits) const {
    const auto* block = reinterpret_cast<const char*>(&pool.blocks[BlockStart(bits) / LightPool::kBlock]);
    for (std::size_t line = 0; line < sizeof(LightPool::Block); line += 64) hwy::Prefetch(block + line);
  }

  /// First entry of a uniformly drawn block of proposals.
  static std::size_t BlockStart(std::uint32_t bits) {
    static_assert(LightPool::kBlock == kProposalBlock && (LightPool::kSize & (LightPool::kSize - 1)) == 0);
    return bits & (LightPool::kSize - LightPool::kBlock);
  }

  /// Draws `point` from the pool's entries entry, entry + 1, ...; returns its targets, `before` only
  /// where it is wanted.
  HWY_INLINE LogTargets Propose(std::size_t entry, VF site_fraction, bool want_before,
                                PointLanes& point) const {
    const LightLanes light = LoadLight(pool, entry);
    point.code = light.code;
    point.site = SiteAt(sites, site_fraction);
    const SurfaceLanes surface = LoadSurfaces(sites, point.site);
    const BsdfLanes f = EvaluateBsdf(surface, light.direction);
    VF log_then = hn::Zero(DF());
    if (want_before) {
      const Vec3Lanes then = LoadLightBefore(pool, entry);
      log_then = LogOrZero(MeanLanes(ReflectedRadiance(surface, f, then.x, then.y, then.z)));
    }
    return TargetsOf(log_then,
                     ReflectedRadiance(surface, f, light.now.r, light.now.g, light.now.b),
                     light.now.density);
  }
};

/// The targets of two frames whose surfaces differ: those of the frame before are seen through the
/// sites that inherit them (OldSurfaces). Otherwise like SameSurfaceTarget.
struct MovedSurfaceTarget {
  const SiteBlock& sites;
  const OldSurfaces& old;
  const EnvironmentView& before;
  const EnvironmentView& now;
  const LightPool& pool;

  HWY_INLINE LogTargets Evaluate(const PointLanes& point) const {
    const Vec3Lanes w = DecodeOctahedral(point.code);
    const RadianceLanes then = EvaluateEnvironment(before, w);
    const RadianceLanes light = EvaluateEnvironment(now, w);
    return Targets(point.site, w, {then.r, then.g, then.b}, {light.r, light.g, light.b},
                   light.density);
  }

  /// As Evaluate, but `before` is left 0.
  HWY_INLINE LogTargets EvaluateNow(const PointLanes& point) const {
    return SameSurfaceTarget{sites, before, now, pool}.EvaluateNow(point);
  }

  bool ManySites() const { return sites.num_hits > 1; }
  HWY_INLINE void Prefetch(std::uint32_t bits) const {
    SameSurfaceTarget{sites, before, now, pool}.Prefetch(bits);
  }
  static std::size_t BlockStart(std::uint32_t bits) { return SameSurfaceTarget::BlockStart(bits); }

  HWY_INLINE LogTargets Propose(std::size_t entry, VF site_fraction, bool want_before,
                                PointLanes& point) const {
    if (!want_before) {
      return SameSurfaceTarget{sites, before, now, pool}.Propose(entry, site_fraction, false, point);
    }
    const LightLanes light = LoadLight(pool, entry);
    point.code = light.code;
    point.site = SiteAt(sites, site_fraction);
    return Targets(point.site, light.direction, LoadLightBefore(pool, entry),
                   {light.now.r, light.now.g, light.now.b}, light.now.density);
  }

 private:
  HWY_INLINE LogTargets Targets(VI site, const Vec3Lanes& w, const Vec3Lanes& then,
                                const Vec3Lanes& light, VF density) const {
    const SurfaceLanes surface_then = LoadSurfaces(old.sites, site);
    const BsdfLanes f_then = EvaluateBsdf(surface_then, w);
    const SurfaceLanes surface = LoadSurfaces(sites, site);
    const BsdfLanes f = EvaluateBsdf(surface, w);
    const VF log_then =
        LogOrZero(MeanLanes(ReflectedRadiance(surface_then, f_then, then.x, then.y, then.z)));
    return TargetsOf(hn::Add(log_then, LookUp(old.log_share, site, sites.num_sites)),
                     ReflectedRadiance(surface, f, light.x, light.y, light.z), density);
  }
};

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
