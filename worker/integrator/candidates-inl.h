// Candidates for sampling-importance-resampling in SIMD: drawn from the light pool and from the
// BRDF, weighted by the balance heuristic. Included once per Highway target.
#if defined(BATON_WORKER_INTEGRATOR_CANDIDATES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_INTEGRATOR_CANDIDATES_INL_H_
#undef BATON_WORKER_INTEGRATOR_CANDIDATES_INL_H_
#else
#define BATON_WORKER_INTEGRATOR_CANDIDATES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/math/low_discrepancy.h"
#include "worker/integrator/kernels.h"
#include "worker/integrator/target-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// How candidates 0, 1, ... of one kind are dealt to the sites: even shares from a random start.
/// Many candidates: all lanes of a vector share a site, which needs no table look-ups; few: each
/// lane has its own.
struct SiteDeal {
  const std::int32_t* sites;
  std::int32_t num_sites;
  std::int32_t count;  ///< candidates of this kind
  float start;         ///< uniform in [0, 1)

  bool ByVector() const {
    return count >= 2 * num_sites * static_cast<std::int32_t>(hn::Lanes(DF()));
  }
  /// Site of the whole vector of candidates i, i + 1, ...
  std::int32_t SiteOfVector(std::size_t i) const {
    const auto first = static_cast<std::size_t>(start * static_cast<float>(num_sites));
    return sites[(i / hn::Lanes(DF()) + first) % static_cast<std::size_t>(num_sites)];
  }
  HWY_INLINE VI SitesOfLanes(std::size_t i) const {
    const DF d;
    const DI di;
    const VF position = hn::Add(hn::Iota(d, static_cast<float>(i)), hn::Set(d, start));
    const VF turn =
        hn::Mul(position, hn::Set(d, static_cast<float>(num_sites) / static_cast<float>(count)));
    return hn::GatherIndex(di, sites, hn::Min(hn::ConvertTo(di, turn), hn::Set(di, num_sites - 1)));
  }
  HWY_INLINE SurfaceLanes Load(const SiteBlock& block, std::size_t i, VI& site) const {
    if (ByVector()) {
      site = hn::Set(DI(), SiteOfVector(i));
      return LoadSurface(block, static_cast<std::size_t>(SiteOfVector(i)));
    }
    site = SitesOfLanes(i);
    return LoadSurfaces(block, site);
  }
};

/// Expected density of BRDF candidates at a site, relative to an even deal over all sites with a
/// surface.
HWY_INLINE VF BsdfDensity(const SiteBlock& sites, const kernels::CandidateCounts& counts,
                          const SurfaceLanes& surface, const BsdfLanes& f) {
  const DF d;
  if (!counts.lobe_only) return MixturePdf(surface, f);
  const VF crowd = hn::Set(
      d, static_cast<float>(sites.num_hits) / static_cast<float>(std::max(sites.num_lobes, 1)));
  return hn::IfThenElseZero(hn::Gt(surface.specular_probability, hn::Zero(d)),
                            hn::Mul(f.lobe_pdf, crowd));
}

/// Sum of weights that are padded by zeros to a whole vector.
HWY_INLINE float SumOfWeights(const float* weight, std::int32_t count) {
  const DF d;
  VF sum = hn::Zero(d);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += hn::Lanes(d)) {
    sum = hn::Add(sum, hn::LoadU(d, weight + i));
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

/// Everything that the two kinds of candidates of a pixel share.
struct CandidateContext {
  const SiteBlock& sites;
  const kernels::CandidateCounts& counts;
  kernels::CandidateSet& out;

  /// Stores candidates at [at, at + lanes) with weight p~ / sum_t M_t q_t, of which the first
  /// `left` count.
  HWY_INLINE void Store(const SurfaceLanes& surface, const BsdfLanes& f, const RadianceLanes& light,
                        VU code, VI site, std::size_t at, std::size_t left) const {
    const DF d;
    const VF share =
        hn::Set(d, static_cast<float>(sites.num_hits) / static_cast<float>(sites.num_sites));
    const Vec3Lanes reflected = ReflectedRadiance(surface, f, light.r, light.g, light.b);
    const VF target = hn::Mul(MeanLanes(reflected), share);
    VF proposal = hn::Mul(hn::Set(d, static_cast<float>(counts.from_light)), light.density);
    if (counts.from_bsdf > 0) {
      proposal = hn::MulAdd(hn::Set(d, static_cast<float>(counts.from_bsdf)),
                            BsdfDensity(sites, counts, surface, f), proposal);
    }
    MF live = hn::And(hn::Gt(target, hn::Zero(d)), hn::Gt(proposal, hn::Zero(d)));
    if (left < hn::Lanes(d)) live = hn::And(live, hn::FirstN(d, left));
    const VF weight =
        hn::IfThenElseZero(live, hn::Div(target, hn::IfThenElse(live, proposal, hn::Set(d, 1.0f))));
    hn::StoreU(code, DU(), out.code + at);
    hn::StoreU(site, DI(), out.site + at);
    hn::StoreU(weight, d, out.weight + at);
    hn::StoreU(reflected.x, d, out.r + at);
    hn::StoreU(reflected.y, d, out.g + at);
    hn::StoreU(reflected.z, d, out.b + at);
  }
};

/// Candidates from the pool: contiguous entries from a random aligned start.
HWY_INLINE void LightCandidates(const CandidateContext& context, const LightPool& pool,
                                const Philox4x32::Counter& random) {
  const DF d;
  const auto count = static_cast<std::size_t>(context.counts.from_light);
  if (count == 0) return;
  const std::uint32_t stride =
      std::clamp(std::bit_floor(static_cast<std::uint32_t>(count)), LightPool::kBlock, 64u);
  const std::size_t start = random[0] % (LightPool::kSize / stride) * stride;
  const SiteDeal deal{context.sites.hit_sites.data(), context.sites.num_hits,
                      context.counts.from_light, uniform_float(random[3])};
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t entry = (start + i) % LightPool::kSize;
    const LightPool::Block& block = pool.blocks[entry / LightPool::kBlock];
    const std::size_t at = entry % LightPool::kBlock;
    VI site;
    const SurfaceLanes surface = deal.Load(context.sites, i, site);
    const BsdfLanes f = EvaluateBsdf(
        surface, {hn::Load(d, block.x + at), hn::Load(d, block.y + at), hn::Load(d, block.z + at)});
    const RadianceLanes light{hn::Load(d, block.r + at), hn::Load(d, block.g + at),
                              hn::Load(d, block.b + at), hn::Load(d, block.density + at)};
    context.Store(surface, f, light, hn::Load(DU(), block.code + at), site, i, count - i);
  }
}

/// Candidates from the BRDF: Sobol' points with the pixel's digital shift, snapped to the lattice.
HWY_INLINE void BsdfCandidates(const CandidateContext& context, const EnvironmentView& environment,
                               const Philox4x32::Counter& random) {
  const DF d;
  const DU du;
  const SobolTable& table = sobol_table();
  const auto count = static_cast<std::size_t>(context.counts.from_bsdf);
  const bool lobe_only = context.counts.lobe_only;
  const SiteDeal deal{lobe_only ? context.sites.lobe_sites.data() : context.sites.hit_sites.data(),
                      lobe_only ? context.sites.num_lobes : context.sites.num_hits,
                      context.counts.from_bsdf, uniform_float(random[3] * 0x9E3779B9u)};
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VU sx = hn::Xor(hn::LoadU(du, table.x.data() + i), hn::Set(du, random[1]));
    const VU sy = hn::Xor(hn::LoadU(du, table.y.data() + i), hn::Set(du, random[2]));
    VI site;
    const SurfaceLanes surface = deal.Load(context.sites, i, site);
    const VF specular_probability = lobe_only ? hn::Set(d, 1.0f) : surface.specular_probability;
    const VU code = EncodeOctahedral(
        SampleBsdf(surface, specular_probability, UniformLanes(d, sx), UniformLanes(d, sy)));
    const Vec3Lanes w = DecodeOctahedral(code);
    context.Store(surface, EvaluateBsdf(surface, w), EvaluateEnvironment(environment, w), code,
                  site, static_cast<std::size_t>(context.counts.from_light) + i, count - i);
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
