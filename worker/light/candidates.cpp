#include "worker/light/candidates.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/light/candidates.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/light/choice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void DrawCandidates(const kernels::CandidateSource& from, kernels::CandidateSet& out) {
  const auto store = [&out](std::int32_t first) HWY_ATTR {
    return [&out, first](const CandidateLanes& c, std::size_t i)
               HWY_ATTR { StoreCandidates(c, static_cast<std::size_t>(first) + i, out); };
  };
  LightCandidates(from, store(0));
  BsdfCandidates(from, store(from.counts.from_light));
  out.count = from.counts.total();
  out.weight.pad(static_cast<std::size_t>(out.count), 0.0f);
  out.total = SumOfWeights(out.weight, out.count);
}

/// What all candidates reflect together.
struct ReflectedLine {
  static constexpr bool kHasColors = true;
  Vec3Lanes colors;  ///< sum of w (f cos L) / p~

  template <class AddColor>
  HWY_INLINE void Add(VU /*code*/, VF /*inverse_density*/, VF /*weight*/,
                      const AddColor& add_color) {
    add_color(hn::Set(DF(), 1.0f), colors);
  }
  void BeginBsdf() {}
};

Rgb ReflectedLight(const kernels::CandidateSource& from, kernels::CandidateSet& from_bsdf) {
  ReflectedLine line;
  SetZero(line.colors);
  WeighCandidates(from, from_bsdf, line);
  return SumOfLanes(line.colors);
}

void ShadeSamples(const SiteBlock& sites, const EnvironmentView& environment,
                  std::span<const OctDirection> code, std::span<const std::uint8_t> site,
                  kernels::ShadedSamples& out) {
  const DF d;
  for (std::size_t i = 0; i < code.size(); i += hn::Lanes(d)) {
    const Vec3Lanes w = DecodeOctahedral(LoadSome(DU(), code, i));
    const SurfaceLanes surface = LoadSurfaces(sites, LoadBytes(site, i));
    const BsdfLanes f = EvaluateBsdf(surface, w);
    const RadianceLanes light = EvaluateEnvironment(environment, w);
    const Vec3Lanes reflected = ReflectedRadiance(surface, f, light.r, light.g, light.b);
    const VF target = MeanLanes(reflected);
    const MF live = hn::Gt(target, hn::Set(d, 1e-37f));
    const VF inverse =
        hn::IfThenElseZero(live, hn::Div(hn::Set(d, 1.0f), hn::Max(target, hn::Set(d, 1e-37f))));
    hn::Store(w.x, d, out.x.from(i));
    hn::Store(w.y, d, out.y.from(i));
    hn::Store(w.z, d, out.z.from(i));
    hn::Store(hn::Mul(reflected.x, inverse), d, out.r.from(i));
    hn::Store(hn::Mul(reflected.y, inverse), d, out.g.from(i));
    hn::Store(hn::Mul(reflected.z, inverse), d, out.b.from(i));
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(DrawCandidates);
HWY_EXPORT(ChooseCandidates);
HWY_EXPORT(ReflectedLight);
HWY_EXPORT(ShadeSamples);

namespace kernels {

void check_source(const CandidateSource& from) {
  const auto& [sites, environment, presampled, counts, random] = from;
  BATON_CHECK(sites.num_hits > 0 && counts.from_light >= 0 && counts.from_bsdf >= 0);
  BATON_CHECK(counts.total() >= 1 && counts.total() <= limits::kMaxCandidates);
  BATON_CHECK(!counts.lobe_only || counts.from_bsdf == 0 ||
              (sites.num_lobes > 0 && counts.from_light > 0));
}

void draw_candidates(const CandidateSource& from, CandidateSet& out) {
  check_source(from);
  out.count = 0;
  out.total = 0;
  if (from.presampled.empty()) return;
  HWY_DYNAMIC_DISPATCH(DrawCandidates)(from, out);
}

float choose_candidates(const CandidateSource& from, float u, ChoiceScratch& scratch,
                        const SampleSpan& out) {
  check_source(from);
  BATON_CHECK(!out.code.empty() && out.code.size() == out.site.size() &&
              out.code.size() == out.r.size());
  if (from.presampled.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChooseCandidates)(from, u, scratch, out);
}

Rgb reflected_light(const CandidateSource& from, CandidateSet& scratch) {
  check_source(from);
  if (from.presampled.empty()) return {};
  return HWY_DYNAMIC_DISPATCH(ReflectedLight)(from, scratch);
}

void shade_samples(const SiteBlock& sites, const EnvironmentView& environment,
                   std::span<const OctDirection> code, std::span<const std::uint8_t> site,
                   ShadedSamples& out) {
  BATON_CHECK(code.size() == site.size() && code.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(ShadeSamples)(sites, environment, code, site, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
