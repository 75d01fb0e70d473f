// Sampling-importance-resampling in SIMD: M candidates are weighed, N are kept. Included once per
// Highway target.
#if defined(BATON_WORKER_LIGHT_CHOICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_LIGHT_CHOICE_INL_H_
#undef BATON_WORKER_LIGHT_CHOICE_INL_H_
#else
#define BATON_WORKER_LIGHT_CHOICE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/poison.h"
#include "worker/light/candidates-inl.h"
#include "worker/sampling/chosen_rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Weighs the candidates from the presampled light of a pixel that sees diffuse surfaces alone:
/// cosine times reflected light over density, and nothing else. line: has Add(code,
/// inverse_density, weight, add_color), where add_color(share, sum) adds share w (f cos L)_rgb / p~
/// to a sum of colours, and kHasColors: it keeps such a sum, `colors`, which the albedo is
/// multiplied to once for all. A copy of the line that stays in registers is what adds.
template <class Line>
HWY_INLINE void WeighDiffuse(const kernels::CandidateSource& from, Line& line) {
  const auto& [sites, environment, presampled, counts, random] = from;
  const DF d;
  const LightRun run(presampled, counts.from_light, random[0]);
  const SiteDeal deal = LightSites(from);
  const VF scale = hn::Set(d, kInvPi / 3.0f * static_cast<float>(sites.num_hits) /
                                  static_cast<float>(sites.num_sites * counts.from_light));
  const auto count = static_cast<std::size_t>(counts.from_light);
  Line adding = line;
  Vec3Lanes colors;
  SetZero(colors);
  // What diffuse surfaces need; a site has a block of eight at a time.
  const auto read = [&](VI /*site*/, const auto& field) HWY_ATTR {
    return std::array<Vec3Lanes, 3>{{{field(sites.ns_x), field(sites.ns_y), field(sites.ns_z)},
                                     {field(sites.ng_x), field(sites.ng_y), field(sites.ng_z)},
                                     {field(sites.kd_r), field(sites.kd_g), field(sites.kd_b)}}};
  };
  deal.ForEachRunOf(
      sites, read,
      [&](const std::array<Vec3Lanes, 3>& surface, std::size_t first, std::size_t last)
          BATON_IN_LOOP {
            const Vec3Lanes ns = surface[0], ng = surface[1], kd = Scale(surface[2], scale);
            if constexpr (Line::kHasColors) SetZero(adding.colors);
            for (std::size_t v = first; v < last; ++v) {
              const std::size_t i = v * hn::Lanes(d);
              const LightLanes light = run.Load(i);
              const VF cosine = Dot(ns, light.direction);
              const VF above = hn::Min(cosine, Dot(ng, light.direction));  // its sign alone counts
              MF live = hn::Gt(above, hn::Zero(d));
              if (i + hn::Lanes(d) > count) live = hn::And(live, hn::FirstN(d, count - i));
              const VF inverse = run.LoadInverse(i);
              const VF each = hn::IfThenElseZero(live, hn::Mul(cosine, inverse));
              const auto add_color = [&](VF share, Vec3Lanes& sum) HWY_ATTR {
                sum = AddScaled({light.now.r, light.now.g, light.now.b}, hn::Mul(each, share), sum);
              };
              const VF reflected = Dot(kd, {light.now.r, light.now.g, light.now.b});
              adding.Add(light.code, inverse, hn::Mul(each, reflected), add_color);
            }
            if constexpr (Line::kHasColors) {
              colors = AddProduct(Scale(kd, hn::Set(d, 3.0f)), adding.colors, colors);
            }
          });
  if constexpr (Line::kHasColors) adding.colors = Add(line.colors, colors);
  line = adding;
}

/// Weighs all candidates of a pixel; those from the BRDF are kept. line: as for WeighDiffuse, and
/// has BeginBsdf(), called between those of the light and those of the BRDF.
template <class Line>
HWY_INLINE void WeighCandidates(const kernels::CandidateSource& from,
                                kernels::CandidateSet& from_bsdf, Line& line) {
  const SiteBlock& sites = from.sites;
  const bool diffuse = !(sites.any_phong || sites.any_ggx || sites.any_measured);
  if (diffuse && from.counts.from_bsdf == 0) {
    WeighDiffuse(from, line);
    line.BeginBsdf();
    return;
  }
  Line adding = line;
  const auto add = [&](const CandidateLanes& c) BATON_IN_LOOP {
    adding.Add(c.code, c.inverse_density, c.weight, [&](VF share, Vec3Lanes& sum) BATON_IN_LOOP {
      sum = AddScaled(c.reflected, hn::Mul(c.per_target, share), sum);
    });
  };
  LightCandidates(from, [&](const CandidateLanes& c, std::size_t) BATON_IN_LOOP { add(c); });
  adding.BeginBsdf();
  BsdfCandidates(from, [&](const CandidateLanes& c, std::size_t i) BATON_IN_LOOP {
    StoreCandidates(c, i, from_bsdf);
    add(c);
  });
  line = adding;
}

/// The line of weights alone.
struct WeightLine {
  static constexpr bool kHasColors = false;
  RunningSums::End end;

  template <class AddColor>
  HWY_INLINE void Add(VU /*code*/, VF /*inverse_density*/, VF weight,
                      const AddColor& /*add_color*/) {
    end.Add(weight);
  }
  void BeginBsdf() {}
};

/// Candidates of the pixel by their number on the line: first those of the presampled light, padded
/// to whole vectors, then those of the BRDF.
class ChosenCandidates {
 public:
  ChosenCandidates(const kernels::CandidateSource& from, const kernels::CandidateSet& from_bsdf)
      : sites_(from.sites),
        run_(from.presampled, from.counts.from_light, from.random[0]),
        deal_(LightSites(from)),
        padded_light_(static_cast<std::int32_t>(
            hwy::RoundUpTo(static_cast<std::size_t>(from.counts.from_light), hn::Lanes(DF())))),
        from_bsdf_(from_bsdf) {}

  /// All about the candidates but for weight and density, which are left undefined.
  HWY_INLINE CandidateLanes Evaluate(VI pick) const {
    const DI di;
    const auto from_bsdf = hn::Gt(pick, hn::Set(di, padded_light_ - 1));
    if (deal_.count == 0) return Stored(pick);
    CandidateLanes out = Presampled(hn::IfThenElseZero(hn::Not(from_bsdf), pick));
    if (hn::AllFalse(di, from_bsdf)) return out;
    const DF d;
    const CandidateLanes stored =
        Stored(hn::IfThenElseZero(from_bsdf, hn::Sub(pick, hn::Set(di, padded_light_))));
    const MF second = hn::RebindMask(d, from_bsdf);
    out.code = hn::IfThenElse(hn::RebindMask(DU(), from_bsdf), stored.code, out.code);
    out.site = hn::IfThenElse(from_bsdf, stored.site, out.site);
    out.reflected = Select(second, stored.reflected, out.reflected);
    return out;
  }

 private:
  HWY_INLINE CandidateLanes Presampled(VI pick) const {
    const DF d;
    const DI di;
    constexpr auto kFields =
        static_cast<std::int32_t>(sizeof(PresampledLight::Block) / sizeof(float));
    static_assert(PresampledLight::kBlock == 8);
    const PresampledLight::Block& first = run_.presampled().blocks[0];
    const VI at =
        hn::Add(hn::Mul(run_.BlockOf(pick), hn::Set(di, kFields)), hn::And(pick, hn::Set(di, 7)));
    const auto read = [&](const float* field) HWY_ATTR { return hn::GatherIndex(d, field, at); };
    CandidateLanes out;
    out.code = hn::BitCast(
        DU(), hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(first.code), at));
    out.site = deal_.SitesOf(pick);
    const SurfaceLanes surface = LoadSurfaces(sites_, out.site);
    const BsdfLanes f = EvaluateBsdf(surface, {read(first.x), read(first.y), read(first.z)});
    out.reflected = ReflectedRadiance(surface, f, read(first.r), read(first.g), read(first.b));
    return out;
  }

  HWY_INLINE CandidateLanes Stored(VI index) const {
    const DF d;
    const DI di;
    CandidateLanes out;
    out.code = hn::BitCast(
        DU(),
        hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(from_bsdf_.code.from(0)), index));
    out.site = hn::GatherIndex(di, from_bsdf_.site.from(0), index);
    out.reflected = {hn::GatherIndex(d, from_bsdf_.r.from(0), index),
                     hn::GatherIndex(d, from_bsdf_.g.from(0), index),
                     hn::GatherIndex(d, from_bsdf_.b.from(0), index)};
    return out;
  }

  const SiteBlock& sites_;
  LightRun run_;
  SiteDeal deal_;
  std::int32_t padded_light_;
  const kernels::CandidateSet& from_bsdf_;
};

inline float ChooseCandidates(const kernels::CandidateSource& from, float u,
                              kernels::ChoiceScratch& scratch, const kernels::SampleSpan& out) {
  // Weigh the candidates.
  RunningSums sums(scratch.running_sums.from(0));
  WeightLine line{sums.end};
  WeighCandidates(from, scratch.from_bsdf, line);
  sums.end = line.end;
  const float total = sums.Finish();
  if (!(total > 0 && std::isfinite(total))) return total;

  // Keep N of them.
  const ChosenCandidates chosen(from, scratch.from_bsdf);
  PaddedArray<std::int32_t, limits::kMaxParticles> picks;
  poison(picks);
  SystematicPicks(sums, total, u, out.code.size(), picks);
  for (std::size_t j = 0; j < out.code.size(); j += hn::Lanes(DF())) {
    const CandidateLanes c = chosen.Evaluate(hn::Load(DI(), picks.from(j)));
    StoreSome(DU(), c.code, out.code, j);
    StoreBytes(c.site, out.site, j);
    StoreSome(c.reflected.x, out.r, j);
    StoreSome(c.reflected.y, out.g, j);
    StoreSome(c.reflected.z, out.b, j);
  }
  return total;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
