// Candidates for sampling-importance-resampling in SIMD: drawn from the presampled light and from
// the BRDF, weighted by the balance heuristic. Included once per Highway target.
#if defined(BATON_WORKER_LIGHT_CANDIDATES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_LIGHT_CANDIDATES_INL_H_
#undef BATON_WORKER_LIGHT_CANDIDATES_INL_H_
#else
#define BATON_WORKER_LIGHT_CANDIDATES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/math/low_discrepancy.h"
#include "common/math/philox-inl.h"
#include "worker/light/candidates.h"
#include "worker/light/presampled_light-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// How candidates 0, 1, ... of one kind are dealt to the sites: even shares, and which site has
/// which is random. Many candidates: all lanes of a vector share a site, which needs no table
/// lookups; few: each lane has its own.
struct SiteDeal {
  const std::int32_t* sites;
  std::int32_t num_sites;
  std::int32_t count;  ///< candidates of this kind
  float start;         ///< uniform in [0, 1)
  /// Candidates lie along a curve of directions: its blocks of eight go to the sites in turn. If a
  /// site had a stretch of the curve for itself, the light there would be seen through it alone,
  /// and the noise of pixels with several normals would not fall with the number of candidates.
  /// Else a site has neighbours: points of a sequence of which no single one matters.
  bool in_turn;

  static constexpr std::size_t kBlock = PresampledLight::kBlock;
  static constexpr std::size_t kVectorsOfBlock = kBlock / hn::MaxLanes(DF());

  std::size_t Vectors() const {
    return (static_cast<std::size_t>(count) + hn::Lanes(DF()) - 1) / hn::Lanes(DF());
  }
  bool ByVector() const {
    const std::size_t least = in_turn ? kBlock : hn::Lanes(DF());
    return static_cast<std::size_t>(count) >= static_cast<std::size_t>(num_sites) * least;
  }
  /// The sites of candidates that lie along a curve, as ForEachRunOf deals them.
  HWY_INLINE VI SitesOf(VI candidate) const {
    const DI di;
    if (num_sites == 1) return hn::Set(di, sites[0]);
    if (!ByVector()) return SitesOfLanes(hn::ConvertTo(DF(), candidate));
    return SitesOfShares(hn::ShiftRight<std::countr_zero(kBlock)>(candidate));
  }

  /// use(read(reader), first, last) for vectors [first, last) that share their surface, in turn;
  /// the reader looks fields of the sites up.
  template <class Read, class Use>
  HWY_INLINE void ForEachRunOf(const SiteBlock& block, const Read& read, const Use& use) const {
    const std::size_t vectors = Vectors();
    const DI di;
    if (!ByVector()) {
      for (std::size_t v = 0; v < vectors; ++v) {
        const VI site = SitesOfLanes(CountFrom(DF(), static_cast<float>(v * hn::Lanes(DF()))));
        use(read(site, [&](const SiteBlock::Array& field)
                           HWY_ATTR { return LookUp(field, site, block.num_sites); }),
            v, v + 1);
      }
      return;
    }
    std::size_t next = FirstSite();
    for (std::size_t k = 0, first = 0; first < vectors; ++k) {
      const std::size_t last = std::min(EndOfShare(k), vectors);
      const auto site = static_cast<std::size_t>(sites[next]);
      use(read(hn::Set(di, sites[next]),
               [&](const SiteBlock::Array& field) HWY_ATTR { return hn::Set(DF(), field[site]); }),
          first, last);
      first = last;
      if (++next == static_cast<std::size_t>(num_sites)) next = 0;
    }
  }
  /// As ForEachRunOf, with all of a surface.
  template <class Use>
  HWY_INLINE void ForEachRun(const SiteBlock& block, const Use& use) const {
    ForEachRunOf(
        block,
        [&](VI site, const auto& read) BATON_IN_LOOP { return ReadSurfaces(block, site, read); },
        use);
  }
  /// use(surface, i) for each vector of candidates i, i + 1, ... in turn.
  template <class Use>
  HWY_INLINE void ForEach(const SiteBlock& block, const Use& use) const {
    ForEachRun(block,
               [&](const SurfaceLanes& surface, std::size_t first, std::size_t last) BATON_IN_LOOP {
                 for (std::size_t v = first; v < last; ++v) use(surface, v * hn::Lanes(DF()));
               });
  }

 private:
  /// Who is dealt the first share, each site as likely as any other, and what `start` has left.
  std::size_t FirstSite() const {
    return static_cast<std::size_t>(start * static_cast<float>(num_sites));
  }
  float Rest() const {
    return start * static_cast<float>(num_sites) - static_cast<float>(FirstSite());
  }
  /// Vector after the k-th share.
  std::size_t EndOfShare(std::size_t k) const {
    const auto n = static_cast<std::size_t>(num_sites);
    if (n == 1) return Vectors();
    return in_turn ? (k + 1) * kVectorsOfBlock : ((k + 1) * Vectors() + n - 1) / n;
  }
  /// Where each lane has its own site.
  HWY_INLINE VI SitesOfLanes(VF candidate) const {
    const DF d;
    const DI di;
    const VF turn = hn::Mul(hn::Add(candidate, hn::Set(d, Rest())),
                            hn::Set(d, static_cast<float>(num_sites) / static_cast<float>(count)));
    return SitesOfShares(hn::Min(hn::ConvertTo(di, turn), hn::Set(di, num_sites - 1)));
  }
  /// Whose turn it is: the remainders of small whole numbers, for which floats are exact enough.
  HWY_INLINE VI SitesOfShares(VI share) const {
    const DF d;
    const DI di;
    const VI turn = hn::Add(share, hn::Set(di, static_cast<std::int32_t>(FirstSite())));
    const VF rounds = hn::Mul(hn::Add(hn::ConvertTo(d, turn), hn::Set(d, 0.5f)),
                              hn::Set(d, 1.0f / static_cast<float>(num_sites)));
    const VI gone = hn::Mul(hn::ConvertTo(di, rounds), hn::Set(di, num_sites));
    return hn::GatherIndex(di, sites, hn::Sub(turn, gone));
  }
};

/// The entries of the presampled light that are a pixel's candidates: blocks spread evenly over a
/// random stretch, in the order of its curve; or, if one stretch has too few, neighbours from a
/// random place on.
class LightRun {
 public:
  /// bits: random. Which blocks are taken depends on `count` and on them alone, and each block is
  /// as likely as any other.
  LightRun(const PresampledLight& presampled, std::int32_t count, std::uint32_t bits)
      : presampled_(presampled) {
    if (count == 0) return;
    const std::uint32_t num_blocks =
        (static_cast<std::uint32_t>(count) + PresampledLight::kBlock - 1) / PresampledLight::kBlock;
    const bool in_one_run = num_blocks <= presampled.run_blocks;
    const std::uint32_t region = in_one_run ? presampled.run_blocks : PresampledLight::kNumBlocks;
    // Whole stretches are read from their beginning. Else, also where the last block is not read to
    // its end, the reading begins anywhere, and the ends are joined.
    const std::uint32_t run = presampled.run_blocks * PresampledLight::kBlock;
    if (static_cast<std::uint32_t>(count) % run == 0) bits &= ~(presampled.run_blocks - 1);
    within_ = static_cast<std::int32_t>(region - 1);
    first_ = static_cast<std::int32_t>(bits & (PresampledLight::kNumBlocks - 1) & ~(region - 1));
    start_ = static_cast<std::int32_t>(bits & (region - 1));
    if (in_one_run) step_ = static_cast<std::int32_t>((region << kStepBits) / num_blocks);
  }
  const PresampledLight& presampled() const { return presampled_; }

  /// Candidates i, i + 1, ...
  HWY_INLINE LightLanes Load(std::size_t i) const { return LoadLight(presampled_, Entry(i)); }
  /// Their 1 / density.
  HWY_INLINE VF LoadInverse(std::size_t i) const {
    const std::size_t entry = Entry(i);
    return hn::Load(DF(), presampled_.blocks[entry / PresampledLight::kBlock].inverse_density +
                              entry % PresampledLight::kBlock);
  }

  /// Block of the presampled light with candidate i.
  HWY_INLINE VI BlockOf(VI i) const {
    const DI di;
    const VI along = hn::ShiftRight<kStepBits>(hn::Mul(hn::ShiftRight<3>(i), hn::Set(di, step_)));
    const VI within = hn::And(hn::Add(along, hn::Set(di, start_)), hn::Set(di, within_));
    return hn::Add(within, hn::Set(di, first_));
  }

 private:
  static_assert(PresampledLight::kBlock == 8);
  static constexpr int kStepBits = 16;  // times the blocks of kMaxCandidates: below 2^31

  std::size_t Entry(std::size_t i) const {
    const std::int32_t along =
        static_cast<std::int32_t>(i / PresampledLight::kBlock) * step_ >> kStepBits;
    const std::int32_t block = first_ + ((along + start_) & within_);
    return static_cast<std::size_t>(block) * PresampledLight::kBlock + i % PresampledLight::kBlock;
  }

  const PresampledLight& presampled_;
  /// Block at which the region begins that is read from.
  std::int32_t first_ = 0;
  std::int32_t start_ = 0;  ///< where in it the reading begins
  /// Blocks of the region, less one: a power of two, less one.
  std::int32_t within_ = 0;
  std::int32_t step_ = 1 << kStepBits;  ///< blocks from one vector to the next
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
HWY_INLINE float SumOfWeights(const kernels::CandidateSet::Column<float>& weight,
                              std::int32_t count) {
  const DF d;
  VF sum = hn::Zero(d);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += hn::Lanes(d)) {
    sum = hn::Add(sum, hn::Load(d, weight.from(i)));
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

/// What the two kinds of candidates of a pixel share: their weights over their targets, 1 / sum_t
/// M_t q_t, and 0 where the target is.
struct CandidateWeights {
  const SiteBlock& sites;
  const kernels::CandidateCounts& counts;

  /// The weights, over their targets, of points that reflect `target` in the mean; the first `left`
  /// count, the others get 0.
  HWY_INLINE VF operator()(VF target, const SurfaceLanes& surface, const BsdfLanes& f,
                           VF light_density, std::size_t left) const {
    const DF d;
    VF proposal = hn::Mul(hn::Set(d, static_cast<float>(counts.from_light)), light_density);
    if (counts.from_bsdf > 0) {
      proposal = hn::MulAdd(hn::Set(d, static_cast<float>(counts.from_bsdf)),
                            BsdfDensity(sites, counts, surface, f), proposal);
    }
    MF live = hn::And(hn::Gt(target, hn::Zero(d)), hn::Gt(proposal, hn::Zero(d)));
    if (left < hn::Lanes(d)) live = hn::And(live, hn::FirstN(d, left));
    const VF share =
        hn::Set(d, static_cast<float>(sites.num_hits) / static_cast<float>(sites.num_sites));
    return hn::IfThenElseZero(live,
                              hn::Div(share, hn::IfThenElse(live, proposal, hn::Set(d, 1.0f))));
  }
};

/// A vector of weighted candidates.
struct CandidateLanes {
  VU code;
  VI site;
  VF weight;
  VF per_target;        ///< weight / p~
  Vec3Lanes reflected;  ///< (f cos L)_rgb
  /// Of the map's table, in sr; past all bounds where there is none.
  VF inverse_density;
};

HWY_INLINE void StoreCandidates(const CandidateLanes& c, std::size_t at,
                                kernels::CandidateSet& out) {
  const DF d;
  hn::StoreU(c.code, DU(), out.code.from(at));
  hn::StoreU(c.site, DI(), out.site.from(at));
  hn::StoreU(c.weight, d, out.weight.from(at));
  hn::StoreU(c.reflected.x, d, out.r.from(at));
  hn::StoreU(c.reflected.y, d, out.g.from(at));
  hn::StoreU(c.reflected.z, d, out.b.from(at));
}

HWY_INLINE SiteDeal LightSites(const kernels::CandidateSource& from) {
  return {from.sites.hit_sites.data(), from.sites.num_hits, from.counts.from_light,
          uniform_float(from.random[3]), true};
}

/// use(candidates, i) for the candidates i, i + 1, ... from the presampled light.
template <class Use>
HWY_INLINE void LightCandidates(const kernels::CandidateSource& from, const Use& use) {
  const auto& [sites, environment, presampled, counts, random] = from;
  if (counts.from_light == 0) return;
  const CandidateWeights weigh{sites, counts};
  const LightRun run(presampled, counts.from_light, random[0]);
  const SiteDeal deal = LightSites(from);
  deal.ForEach(sites, [&](const SurfaceLanes& surface, std::size_t i) BATON_IN_LOOP {
    const LightLanes light = run.Load(i);
    const BsdfLanes f = EvaluateBsdf(surface, light.direction);
    const Vec3Lanes reflected =
        ReflectedRadiance(surface, f, light.now.r, light.now.g, light.now.b);
    const VF target = MeanLanes(reflected);
    const VF per_target = weigh(target, surface, f, light.now.density,
                                static_cast<std::size_t>(counts.from_light) - i);
    use(CandidateLanes{light.code, surface.site, hn::Mul(target, per_target), per_target, reflected,
                       light.inverse_density},
        i);
  });
}

/// A vector of directions drawn from the BRDF, on the lattice of `to_map` * world.
struct BsdfRun {
  const SiteBlock& sites;
  const kernels::CandidateCounts& counts;
  const Philox4x32::Counter& random;

  SiteDeal Deal() const {
    const bool lobes = counts.lobe_only;
    return {lobes ? sites.lobe_sites.data() : sites.hit_sites.data(),
            lobes ? sites.num_lobes : sites.num_hits, counts.from_bsdf,
            uniform_float(random[3] * 0x9E3779B9u), false};
  }
  /// texels = locate(surface, i, code) for the directions i, i + 1, ..., some vectors ahead of
  /// use(surface, i, code, texels).
  template <class Locate, class Use>
  HWY_INLINE void ForEachLocated(const Locate& locate, const Use& use) const {
    constexpr std::size_t kAhead = 8;
    const auto some = [&](const SurfaceLanes& surface, std::size_t first, std::size_t last)
                          HWY_ATTR {
                            const std::size_t lanes = hn::Lanes(DF());
                            VU code[kAhead];
                            TexelLanes texels[kAhead];
                            for (std::size_t v = first; v < last; ++v) {
                              texels[v - first] = locate(surface, v * lanes, code[v - first]);
                            }
                            for (std::size_t v = first; v < last; ++v) {
                              use(surface, v * lanes, code[v - first], texels[v - first]);
                            }
                          };
    Deal().ForEachRun(
        sites, [&](const SurfaceLanes& surface, std::size_t first, std::size_t last) HWY_ATTR {
          for (std::size_t v = first; v < last; v += kAhead) {
            some(surface, v, std::min(v + kAhead, last));
          }
        });
  }
  /// Directions i, i + 1, ...: Sobol' points with the pixel's digital shift.
  HWY_INLINE Vec3Lanes Draw(const SurfaceLanes& surface, std::size_t i) const {
    const DF d;
    const DU du;
    const SobolTable& table = sobol_table();
    const VU sx = hn::Xor(hn::Load(du, table.x.from(i)), hn::Set(du, random[1]));
    const VU sy = hn::Xor(hn::Load(du, table.y.from(i)), hn::Set(du, random[2]));
    return SampleBsdf(surface, counts.lobe_only ? hn::Set(d, 1.0f) : surface.specular_probability,
                      UniformLanes(d, sx), UniformLanes(d, sy));
  }
};

/// use(candidates, i) for the candidates i, i + 1, ... from the BRDF, snapped to the lattice. Their
/// texels are prefetched some vectors ahead.
template <class Use>
HWY_INLINE void BsdfCandidates(const kernels::CandidateSource& from, const Use& use) {
  const auto& [sites, environment, presampled, counts, random] = from;
  if (counts.from_bsdf == 0) return;
  const CandidateWeights weigh{sites, counts};
  const BsdfRun run{sites, counts, random};
  const auto locate = [&](const SurfaceLanes& surface, std::size_t i, VU& code) HWY_ATTR {
    code = EncodeOctahedral(run.Draw(surface, i));
    const TexelLanes texels = LocateTexels(environment, DecodeOctahedral(code));
    PrefetchTexels(environment, texels);
    return texels;
  };
  run.ForEachLocated(locate, [&](const SurfaceLanes& surface, std::size_t i, VU code,
                                 const TexelLanes& texels) HWY_ATTR {
    const RadianceLanes light = EvaluateTexels(environment, texels);
    const BsdfLanes f = EvaluateBsdf(surface, DecodeOctahedral(code));
    const Vec3Lanes reflected = ReflectedRadiance(surface, f, light.r, light.g, light.b);
    const VF target = MeanLanes(reflected);
    const VF per_target =
        weigh(target, surface, f, light.density, static_cast<std::size_t>(counts.from_bsdf) - i);
    const VF inverse_density = hn::Div(hn::Set(DF(), 1.0f), hn::Abs(light.density));
    use(CandidateLanes{code, surface.site, hn::Mul(target, per_target), per_target, reflected,
                       inverse_density},
        i);
  });
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
