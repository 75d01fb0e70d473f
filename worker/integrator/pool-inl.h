// The pool of a pixel in SIMD: weights of carried particles and fresh candidates (sampling/pool.h).
// Included once per Highway target.
#if defined(BATON_WORKER_INTEGRATOR_POOL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_INTEGRATOR_POOL_INL_H_
#undef BATON_WORKER_INTEGRATOR_POOL_INL_H_
#else
#define BATON_WORKER_INTEGRATOR_POOL_INL_H_
#endif

#include <hwy/highway.h>

#include "worker/integrator/candidates-inl.h"
#include "worker/integrator/pool_kernels.h"
#include "worker/sampling/pool.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A point of the pool per lane with both targets.
struct PoolPoint {
  VU code;
  VI site;
  Vec3Lanes world;      ///< direction
  Vec3Lanes reflected;  ///< (f cos L)_rgb now
  VF target;            ///< their mean
  VF target_before;
};

/// Estimated share of free rays per lane, as free_share().
HWY_INLINE VF FreeShare(const VisibilityCell* memory, const Vec3Lanes& w) {
  const DF d;
  const DI di;
  const VF one = hn::Set(d, 1.0f);
  const VF half = hn::Set(d, 0.5f);
  const VF inv = hn::Div(one, hn::Add(hn::Abs(w.x), hn::Add(hn::Abs(w.y), hn::Abs(w.z))));
  const VF u = hn::Mul(w.x, inv);
  const VF v = hn::Mul(w.z, inv);
  const MF below = hn::Lt(w.y, hn::Zero(d));
  const VF fold_u = hn::IfThenElse(below, hn::CopySign(hn::Sub(one, hn::Abs(v)), u), u);
  const VF fold_v = hn::IfThenElse(below, hn::CopySign(hn::Sub(one, hn::Abs(u)), v), v);
  const VF side = hn::Set(d, static_cast<float>(kVisibilityGridSide));
  const auto cell = [&](VF t) HWY_ATTR {
    const VI index = hn::ConvertTo(di, hn::Mul(hn::MulAdd(t, half, half), side));
    return hn::Min(hn::Max(index, hn::Zero(di)), hn::Set(di, kVisibilityGridSide - 1));
  };
  const VI bin = hn::Add(hn::ShiftLeft<4>(cell(fold_v)), cell(fold_u));

  // Two cells come with each load; ours is the lower one.
  static_assert(kVisibilityGridSide == 16 && sizeof(VisibilityCell) == 2 &&
                kVisibilityCells > kVisibilityBins);
  const VI pair =
      hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(memory), hn::ShiftLeft<1>(bin));
  const VI own = hn::And(pair, hn::Set(di, 0xFFFF));
  const VisibilityCell all = memory[kVisibilitySummary];
  const auto unseen = hn::Eq(hn::And(own, hn::Set(di, 15)), hn::Zero(di));
  const VI bits = hn::IfThenElse(unseen, hn::Set(di, (all & 15) != 0 ? all : 2048 << 4), own);
  return hn::Mul(hn::Add(hn::ConvertTo(d, hn::ShiftRight<4>(bits)), half), hn::Set(d, 1.0f / 4096));
}

/// Targets below it count as none; its products with densities are normal numbers.
inline constexpr float kDark = 1e-20f;

/// The surfaces that carried particles come from, turned with the environment: a direction of now
/// meets them where the particle's direction of then met the surfaces themselves.
inline SiteBlock TurnedSurfaces(const kernels::PoolInput& input) {
  SiteBlock sites = input.old != nullptr ? input.old->sites : input.sites;
  const Mat3 turn = input.now.rotation * input.before.rotation.transposed();
  const auto apply = [&](std::size_t s, SiteBlock::Array& x, SiteBlock::Array& y,
                         SiteBlock::Array& z) {
    const Vec3 v = turn * Vec3{x[s], y[s], z[s]};
    x[s] = v.x;
    y[s] = v.y;
    z[s] = v.z;
  };
  for (std::size_t s = 0; s < static_cast<std::size_t>(sites.num_sites); ++s) {
    apply(s, sites.ns_x, sites.ns_y, sites.ns_z);
    apply(s, sites.ng_x, sites.ng_y, sites.ng_z);
    apply(s, sites.wo_x, sites.wo_y, sites.wo_z);
    apply(s, sites.mirror_x, sites.mirror_y, sites.mirror_z);
  }
  return sites;
}

/// A vector of carried particles, located before it is needed.
struct CarriedLanes {
  VU code;
  VI site;
  VF contribution;
  Vec3Lanes map_direction;
  TexelLanes texels;
};

/// Fills the halves of one pixel's pool.
class PoolGatherer {
 public:
  PoolGatherer(const kernels::PoolInput& input, const PoolSettings& settings)
      : input_(input),
        settings_(settings),
        now_(unturned_view_of(input.now)),
        before_(unturned_view_of(input.before)),
        same_surface_(input.old == nullptr && input.now.rotation.m == input.before.rotation.m),
        same_light_(input.now.map == input.before.map),
        same_grid_(now_.width == before_.width && now_.height == before_.height) {
    if (input.has_history && !same_surface_) surfaces_before_.emplace(TurnedSurfaces(input));
  }

  /// Fills both halves.
  HWY_INLINE void Gather(const Rng& rng, std::array<kernels::PoolHalf, 2>& out) const {
    // The texels of the particles arrive while the light pool's candidates are looked at.
    const std::size_t vectors = input_.has_history ? VectorsOfHalf() : 0;
    CarriedLanes carried[2 * kMaxVectors];
    for (std::size_t v = 0; v < 2 * vectors; ++v) {
      carried[v] = Locate(v / vectors, v % vectors * hn::Lanes(DF()));
      Prefetch(carried[v].texels);
    }
    const DF d;
    const auto sum = [&](VF v) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(d, v)); };
    for (std::uint32_t half = 0; half < 2; ++half) {
      const Philox4x32::Counter random = rng.bits(0, half);
      kernels::PoolHalf& pool = out[half];
      pool.count = 0;
      Sums sums{hn::Zero(d), hn::Zero(d), hn::Zero(d), {hn::Zero(d), hn::Zero(d), hn::Zero(d)}};
      AddLight(random, pool, sums);
      AddBsdf(random, pool, sums);
      for (std::size_t v = 0; v < vectors; ++v) AddCarried(carried[half * vectors + v], pool, sums);
      pool.lns = sum(sums.weight);
      pool.lns_fresh = sum(sums.fresh);
      pool.visible = sum(sums.visible);
      pool.visible_color = {sum(sums.color.x), sum(sums.color.y), sum(sums.color.z)};
      pool.carry_total = SumOfWeights(pool.carry_weight, pool.count);
      pool.ray_total = SumOfWeights(pool.ray_weight, pool.count);
    }
  }

 private:
  static constexpr std::size_t kMaxVectors =
      (limits::kMaxParticles / 2 + hn::MaxLanes(DF()) - 1) / hn::MaxLanes(DF());
  struct Sums {
    VF weight, fresh, visible;
    Vec3Lanes color;
  };

  /// Whether the target before is that of now: nothing has changed, or there is none.
  bool SameTarget() const { return !input_.has_history || (same_surface_ && same_light_); }

  /// Whether radiance differs between the frames.
  bool ReadsBefore() const { return !same_light_ && input_.has_history; }

  HWY_INLINE void Prefetch(const TexelLanes& texels) const {
    PrefetchTexels(now_, texels);
    if (ReadsBefore() && same_grid_) PrefetchTexels(before_, texels);
  }

  /// Radiance of the frame before along map directions, which lie on `texels` of the map of now.
  HWY_INLINE RadianceLanes Before(const Vec3Lanes& map_direction, const TexelLanes& texels) const {
    return same_grid_ ? EvaluateTexels(before_, texels)
                      : EvaluateEnvironment(before_, map_direction);
  }

  /// Reflected light now, and both targets. f: of `surface` now. before: the surface that the site
  /// inherits from, its samples shared among heirs (OldSurfaces).
  HWY_INLINE void SetTargets(const SurfaceLanes& surface, const SurfaceLanes& before,
                             const BsdfLanes& f, const RadianceLanes& light,
                             const RadianceLanes& then, PoolPoint& p) const {
    p.reflected = ReflectedRadiance(surface, f, light.r, light.g, light.b);
    p.target = MeanLanes(p.reflected);
    p.target_before = p.target;
    if (SameTarget()) return;
    const BsdfLanes f_before = same_surface_ ? f : EvaluateBsdf(before, p.world);
    p.target_before = MeanLanes(ReflectedRadiance(before, f_before, then.r, then.g, then.b));
    if (input_.old == nullptr) return;
    const VF log_share = LookUp(input_.old->log_share, p.site, input_.sites.num_sites);
    p.target_before = hn::Mul(p.target_before, ExpLanes(log_share));
  }

  HWY_INLINE VF Gain() const { return hn::Set(DF(), input_.has_history ? settings_.gain : 0.0f); }

  /// fresh_weight() of candidates over their target; the first `left` count.
  HWY_INLINE VF FreshWeight(const PoolPoint& p, const SurfaceLanes& surface, const BsdfLanes& f,
                            VF light_density, std::size_t left) const {
    const DF d;
    const kernels::CandidateCounts& counts = input_.counts;
    VF proposal = hn::Mul(hn::Set(d, static_cast<float>(counts.from_light)), light_density);
    if (counts.from_bsdf > 0) {
      proposal = hn::MulAdd(hn::Set(d, static_cast<float>(counts.from_bsdf)),
                            BsdfDensity(input_.sites, counts, surface, f), proposal);
    }
    MF live = hn::And(hn::Gt(p.target, hn::Set(d, kDark)), hn::Gt(proposal, hn::Zero(d)));
    if (left < hn::Lanes(d)) live = hn::And(live, hn::FirstN(d, left));
    const VF share = hn::Set(
        d, static_cast<float>(input_.sites.num_hits) / static_cast<float>(input_.sites.num_sites));
    const VF balance = hn::Mul(hn::MulAdd(Gain(), p.target_before, p.target), proposal);
    return hn::IfThenElseZero(
        live, hn::Div(hn::Mul(p.target, share), hn::IfThenElse(live, balance, hn::Set(d, 1.0f))));
  }

  /// Appends fresh candidates, which also estimate Lns by themselves.
  HWY_INLINE void AppendFresh(const PoolPoint& p, VF per_target, kernels::PoolHalf& out,
                              Sums& sums) const {
    const VF both = hn::MulAdd(Gain(), p.target_before, p.target);
    sums.fresh = hn::MulAdd(per_target, both, sums.fresh);
    Append(p, per_target, out, sums);
  }

  /// Appends a vector of points. per_target: their weight over their target.
  HWY_INLINE void Append(const PoolPoint& p, VF per_target, kernels::PoolHalf& out,
                         Sums& sums) const {
    const DF d;
    const VF one = hn::Set(d, 1.0f);
    const VF weight = hn::Mul(p.target, per_target);
    const auto at = static_cast<std::size_t>(out.count);
    const VF r = hn::Mul(p.reflected.x, per_target);
    const VF g = hn::Mul(p.reflected.y, per_target);
    const VF b = hn::Mul(p.reflected.z, per_target);
    hn::StoreU(p.code, DU(), out.code + at);
    hn::StoreU(p.site, DI(), out.site + at);
    hn::StoreU(p.world.x, d, out.x + at);
    hn::StoreU(p.world.y, d, out.y + at);
    hn::StoreU(p.world.z, d, out.z + at);
    hn::StoreU(weight, d, out.weight + at);
    hn::StoreU(r, d, out.r + at);
    hn::StoreU(g, d, out.g + at);
    hn::StoreU(b, d, out.b + at);
    sums.weight = hn::Add(sums.weight, weight);
    out.count += static_cast<std::int32_t>(hn::Lanes(d));

    // Without memory every direction is alike and nothing is known beforehand.
    if (input_.memory.empty()) {
      hn::StoreU(hn::Zero(d), d, out.free + at);
      hn::StoreU(weight, d, out.carry_weight + at);
      hn::StoreU(weight, d, out.ray_weight + at);
      return;
    }
    const VF free = FreeShare(input_.memory.data(), p.world);
    const VF carry = hn::Mul(weight, hn::Max(hn::Sqrt(free), hn::Set(d, kLeastHope)));
    const VF doubt = hn::Sqrt(hn::Mul(free, hn::Sub(one, free)));
    const VF ray = hn::Mul(weight, hn::Max(doubt, hn::Set(d, kLeastDoubt)));
    hn::StoreU(free, d, out.free + at);
    hn::StoreU(carry, d, out.carry_weight + at);
    hn::StoreU(ray, d, out.ray_weight + at);
    sums.visible = hn::MulAdd(weight, free, sums.visible);
    sums.color = {hn::MulAdd(r, free, sums.color.x), hn::MulAdd(g, free, sums.color.y),
                  hn::MulAdd(b, free, sums.color.z)};
  }

  std::size_t ParticlesOfHalf() const {
    return static_cast<std::size_t>(settings_.num_carried / 2);
  }
  std::size_t VectorsOfHalf() const {
    return (ParticlesOfHalf() + hn::Lanes(DF()) - 1) / hn::Lanes(DF());
  }

  /// Particles i, i + 1, ... of a half, which stands for the whole pixel: they count double.
  HWY_INLINE CarriedLanes Locate(std::size_t half, std::size_t i) const {
    const DF d;
    const std::size_t first = half * ParticlesOfHalf() + i;
    HWY_ALIGN std::uint32_t codes[hn::MaxLanes(DU())] = {};
    HWY_ALIGN std::int32_t sites[hn::MaxLanes(DI())] = {};
    HWY_ALIGN float contributions[hn::MaxLanes(DF())] = {};
    for (std::size_t lane = 0; lane < std::min(ParticlesOfHalf() - i, hn::Lanes(d)); ++lane) {
      codes[lane] = input_.code[first + lane];
      sites[lane] = input_.site[first + lane];
      contributions[lane] = 2 * input_.contribution[first + lane];
    }
    CarriedLanes p;
    p.code = hn::Load(DU(), codes);
    p.site = hn::Load(DI(), sites);
    p.contribution = hn::Load(d, contributions);
    p.map_direction = DecodeOctahedral(p.code);
    p.texels = LocateTexels(now_, p.map_direction);
    return p;
  }

  /// Particles with their carried_weight().
  HWY_INLINE void AddCarried(const CarriedLanes& particles, kernels::PoolHalf& out,
                             Sums& sums) const {
    const DF d;
    PoolPoint p;
    p.code = particles.code;
    p.site = particles.site;
    const SurfaceLanes surface = LoadSurfaces(input_.sites, p.site);
    VF density;
    Evaluate(surface, same_surface_ ? surface : LoadSurfaces(*surfaces_before_, p.site),
             particles.map_direction, particles.texels, p, density);
    const MF live =
        hn::And(hn::Gt(p.target, hn::Set(d, kDark)), hn::Gt(p.target_before, hn::Zero(d)));
    const VF total =
        hn::IfThenElse(live, hn::MulAdd(Gain(), p.target_before, p.target), hn::Set(d, 1.0f));
    const VF share = hn::Div(Gain(), total);
    Append(p, hn::IfThenElseZero(live, hn::Mul(share, particles.contribution)), out, sums);
  }

  /// Looks everything up at directions in the map's frame, which lie on `texels` of the map of now;
  /// density: of the light's table.
  HWY_INLINE BsdfLanes Evaluate(const SurfaceLanes& surface, const SurfaceLanes& before,
                                const Vec3Lanes& map_direction, const TexelLanes& texels,
                                PoolPoint& p, VF& density) const {
    p.world = Transform(input_.now.rotation.m.data(), map_direction);
    const BsdfLanes f = EvaluateBsdf(surface, p.world);
    const RadianceLanes light = EvaluateTexels(now_, texels);
    const RadianceLanes then = ReadsBefore() ? Before(map_direction, texels) : light;
    SetTargets(surface, before, f, light, then, p);
    density = light.density;
    return f;
  }

  /// The surfaces before of the sites of `now`; `now`, where they are the same.
  HWY_INLINE SurfaceLanes LoadBefore(const SurfaceLanes& now) const {
    return !input_.has_history || same_surface_ ? now : LoadSurfaces(*surfaces_before_, now.site);
  }

  /// Fresh candidates from the light pool.
  HWY_INLINE void AddLight(const Philox4x32::Counter& random, kernels::PoolHalf& out,
                           Sums& sums) const {
    const auto count = static_cast<std::size_t>(input_.counts.from_light);
    if (count == 0) return;
    const LightRun run(input_.light_pool, input_.counts.from_light, random[0]);
    const SiteDeal deal = LightSites(input_.sites, input_.counts, random);
    deal.ForEach(input_.sites, [&](const SurfaceLanes& surface, std::size_t i) HWY_ATTR {
      const LightLanes light = run.Load(i);
      const Vec3Lanes then = run.LoadBefore(i);
      PoolPoint p;
      p.code = light.code;
      p.site = surface.site;
      p.world = light.direction;
      const BsdfLanes f = EvaluateBsdf(surface, p.world);
      SetTargets(surface, LoadBefore(surface), f, light.now,
                 {then.x, then.y, then.z, light.now.density}, p);
      AppendFresh(p, FreshWeight(p, surface, f, light.now.density, count - i), out, sums);
    });
  }

  /// Fresh candidates from the BRDF, snapped to the lattice of the map's frame.
  HWY_INLINE void AddBsdf(const Philox4x32::Counter& random, kernels::PoolHalf& out,
                          Sums& sums) const {
    const auto count = static_cast<std::size_t>(input_.counts.from_bsdf);
    if (count == 0) return;
    const BsdfRun run{input_.sites, input_.counts, random};
    const auto locate = [&](const SurfaceLanes& surface, std::size_t i, VU& code) HWY_ATTR {
      code = EncodeOctahedral(Transform(to_map_.m.data(), run.Draw(surface, i)));
      const TexelLanes texels = LocateTexels(now_, DecodeOctahedral(code));
      Prefetch(texels);
      return texels;
    };
    run.ForEachLocated(locate, [&](const SurfaceLanes& surface, std::size_t i, VU code,
                                   const TexelLanes& texels) HWY_ATTR {
      PoolPoint p;
      p.code = code;
      p.site = surface.site;
      VF density;
      const BsdfLanes f =
          Evaluate(surface, LoadBefore(surface), DecodeOctahedral(code), texels, p, density);
      AppendFresh(p, FreshWeight(p, surface, f, density, count - i), out, sums);
    });
  }

  const kernels::PoolInput& input_;
  const PoolSettings& settings_;
  const EnvironmentView now_, before_;  ///< for directions in the map's frame
  const bool same_surface_;             ///< as seen from the map
  const bool same_light_;               ///< the map's texels
  const bool same_grid_;                ///< the maps' sizes
  const Mat3 to_map_ = input_.now.rotation.transposed();
  std::optional<SiteBlock> surfaces_before_;  ///< turned; where they differ from those of now
};

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
