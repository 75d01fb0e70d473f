#include "worker/integrator/kernels.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/choice-inl.h"
#include "worker/integrator/target-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void DecodeDirections(std::span<const OctDirection> code, std::span<float> x, std::span<float> y,
                      std::span<float> z) {
  for (std::size_t i = 0; i < code.size(); i += hn::Lanes(DF())) {
    const Vec3Lanes w = DecodeOctahedral(LoadSome(DU(), code, i));
    StoreSome(w.x, x, i);
    StoreSome(w.y, y, i);
    StoreSome(w.z, z, i);
  }
}

void EvaluateEnvironmentSpans(const EnvironmentView& view, std::span<const float> x,
                              std::span<const float> y, std::span<const float> z,
                              std::span<float> r, std::span<float> g, std::span<float> b,
                              std::span<float> density) {
  for (std::size_t i = 0; i < x.size(); i += hn::Lanes(DF())) {
    const RadianceLanes light =
        EvaluateEnvironment(view, {LoadSome(x, i), LoadSome(y, i), LoadSome(z, i)});
    StoreSome(light.r, r, i);
    StoreSome(light.g, g, i);
    StoreSome(light.b, b, i);
    StoreSome(light.density, density, i);
  }
}

void EvaluateBsdfSpans(const SiteBlock& sites, std::span<const std::int32_t> site,
                       std::span<const float> x, std::span<const float> y, std::span<const float> z,
                       std::span<float> r, std::span<float> g, std::span<float> b,
                       std::span<float> pdf) {
  const VF one = hn::Set(DF(), 1.0f);
  for (std::size_t i = 0; i < x.size(); i += hn::Lanes(DF())) {
    const SurfaceLanes surface = LoadSurfaces(sites, LoadSome(DI(), site, i));
    const BsdfLanes f = EvaluateBsdf(surface, {LoadSome(x, i), LoadSome(y, i), LoadSome(z, i)});
    const Vec3Lanes reflected = ReflectedRadiance(surface, f, one, one, one);
    StoreSome(reflected.x, r, i);
    StoreSome(reflected.y, g, i);
    StoreSome(reflected.z, b, i);
    StoreSome(MixturePdf(surface, f), pdf, i);
  }
}

void SampleBsdfSpans(const SiteBlock& sites, std::span<const std::int32_t> site,
                     std::span<const float> u0, std::span<const float> u1, std::span<float> x,
                     std::span<float> y, std::span<float> z) {
  for (std::size_t i = 0; i < u0.size(); i += hn::Lanes(DF())) {
    const SurfaceLanes surface = LoadSurfaces(sites, LoadSome(DI(), site, i));
    const Vec3Lanes w =
        SampleBsdf(surface, surface.specular_probability, LoadSome(u0, i), LoadSome(u1, i));
    StoreSome(w.x, x, i);
    StoreSome(w.y, y, i);
    StoreSome(w.z, z, i);
  }
}

void DrawCandidates(const SiteBlock& sites, const EnvironmentView& environment,
                    const LightPool& pool, const kernels::CandidateCounts& counts, const Rng& rng,
                    kernels::CandidateSet& out) {
  const Philox4x32::Counter random = rng.bits(0, 0);
  const auto store = [&out](std::int32_t first) HWY_ATTR {
    return [&out, first](const CandidateLanes& c, std::size_t i)
               HWY_ATTR { StoreCandidates(c, static_cast<std::size_t>(first) + i, out); };
  };
  LightCandidates(sites, pool, counts, random, store(0));
  BsdfCandidates(sites, environment, counts, random, store(counts.from_light));
  out.count = counts.total();
  out.weight.pad(static_cast<std::size_t>(out.count), 0.0f);
  out.total = SumOfWeights(out.weight, out.count);
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

/// Notes where directions lie in a map from place i on, and asks for the texels.
HWY_INLINE void Locate(const EnvironmentView& view, const Vec3Lanes& w, std::size_t i,
                       kernels::LocatedDirections::Place& out) {
  const DF d;
  const TexelLanes at = LocateTexels(view, w);
  PrefetchTexels(view, at);
  hn::Store(at.index, DI(), out.texel.from(i));
  hn::Store(at.fx, d, out.right.from(i));
  hn::Store(at.fy, d, out.down.from(i));
}

void LocateDirections(const EnvironmentView& now, const EnvironmentView* before,
                      std::span<const OctDirection> code, kernels::LocatedDirections& out) {
  const DF d;
  for (std::size_t i = 0; i < code.size(); i += hn::Lanes(d)) {
    HWY_ALIGN std::uint32_t codes[hn::MaxLanes(DU())];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      codes[lane] = code[std::min(i + lane, code.size() - 1)];
    }
    const Vec3Lanes w = DecodeOctahedral(hn::Load(DU(), codes));
    hn::Store(w.x, d, out.x.from(i));
    hn::Store(w.y, d, out.y.from(i));
    hn::Store(w.z, d, out.z.from(i));
    Locate(now, w, i, out.now);
    if (before != nullptr) Locate(*before, w, i, out.before);
  }
  out.has_before = before != nullptr;
}

SequentialOutcome SequentialPixel(const SiteBlock& sites, const kernels::CarriedLight& light,
                                  const kernels::LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles) {
  const SameSurfaceTarget target{sites, light, located};
  return SequentialStep(target, settings, lns_before, Rng(key, PassId::move),
                        Rng(key, PassId::resample), particles);
}

SequentialOutcome SequentialMovedPixel(const SiteBlock& sites, const OldSurfaces& old,
                                       const kernels::CarriedLight& light,
                                       const kernels::LocatedDirections* located,
                                       const SequentialSettings& settings, float lns_before,
                                       const RngKey& key, ParticleSpan particles) {
  const MovedSurfaceTarget target{{sites, light, located}, old};
  return SequentialStep(target, settings, lns_before, Rng(key, PassId::move),
                        Rng(key, PassId::resample), particles);
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(DecodeDirections);
HWY_EXPORT(EvaluateEnvironmentSpans);
HWY_EXPORT(EvaluateBsdfSpans);
HWY_EXPORT(SampleBsdfSpans);
HWY_EXPORT(DrawCandidates);
HWY_EXPORT(ChooseCandidates);
HWY_EXPORT(ShadeSamples);
HWY_EXPORT(LocateDirections);
HWY_EXPORT(SequentialPixel);
HWY_EXPORT(SequentialMovedPixel);
HWY_EXPORT(TargetName);

namespace kernels {

std::string instruction_set() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

void decode_directions(std::span<const OctDirection> code, std::span<float> x, std::span<float> y,
                       std::span<float> z) {
  HWY_DYNAMIC_DISPATCH(DecodeDirections)(code, x, y, z);
}

void evaluate_environment(const EnvironmentView& view, std::span<const float> x,
                          std::span<const float> y, std::span<const float> z, std::span<float> r,
                          std::span<float> g, std::span<float> b, std::span<float> density) {
  HWY_DYNAMIC_DISPATCH(EvaluateEnvironmentSpans)(view, x, y, z, r, g, b, density);
}

void evaluate_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                   std::span<const float> x, std::span<const float> y, std::span<const float> z,
                   std::span<float> r, std::span<float> g, std::span<float> b,
                   std::span<float> pdf) {
  HWY_DYNAMIC_DISPATCH(EvaluateBsdfSpans)(sites, site, x, y, z, r, g, b, pdf);
}

void sample_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                 std::span<const float> u0, std::span<const float> u1, std::span<float> x,
                 std::span<float> y, std::span<float> z) {
  HWY_DYNAMIC_DISPATCH(SampleBsdfSpans)(sites, site, u0, u1, x, y, z);
}

void check_counts(const SiteBlock& sites, const CandidateCounts& counts) {
  BATON_CHECK(sites.num_hits > 0 && counts.from_light >= 0 && counts.from_bsdf >= 0);
  BATON_CHECK(counts.total() >= 1 && counts.total() <= limits::kMaxCandidates);
  BATON_CHECK(!counts.lobe_only || counts.from_bsdf == 0 ||
              (sites.num_lobes > 0 && counts.from_light > 0));
}

void draw_candidates(const SiteBlock& sites, const EnvironmentView& environment,
                     const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                     CandidateSet& out) {
  check_counts(sites, counts);
  out.count = 0;
  out.total = 0;
  if (pool.empty()) return;
  HWY_DYNAMIC_DISPATCH(DrawCandidates)(sites, environment, pool, counts, rng, out);
}

float choose_candidates(const SiteBlock& sites, const EnvironmentView& environment,
                        const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                        float u, ChoiceScratch& scratch, const SampleSpan& out) {
  check_counts(sites, counts);
  BATON_CHECK(!out.code.empty() && out.code.size() == out.site.size() &&
              out.code.size() == out.r.size());
  if (pool.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChooseCandidates)(sites, environment, pool, counts, rng, u, scratch,
                                                out);
}

void shade_samples(const SiteBlock& sites, const EnvironmentView& environment,
                   std::span<const OctDirection> code, std::span<const std::uint8_t> site,
                   ShadedSamples& out) {
  BATON_CHECK(code.size() == site.size() && code.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(ShadeSamples)(sites, environment, code, site, out);
}

void locate_directions(const EnvironmentView& now, const EnvironmentView* before,
                       std::span<const OctDirection> code, LocatedDirections& out) {
  BATON_CHECK(code.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(LocateDirections)(now, before, code, out);
}

SequentialOutcome sequential_step(const SiteBlock& sites, const OldSurfaces* old,
                                  const CarriedLight& light, const LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles) {
  BATON_CHECK(settings.num_particles >= 1 && settings.num_particles <= limits::kMaxParticles);
  if (light.pool.empty() || !(lns_before > 0)) return {};
  BATON_CHECK(light.pool.has_before);
  if (old != nullptr) {
    return HWY_DYNAMIC_DISPATCH(SequentialMovedPixel)(sites, *old, light, located, settings,
                                                      lns_before, key, particles);
  }
  return HWY_DYNAMIC_DISPATCH(SequentialPixel)(sites, light, located, settings, lns_before, key,
                                               particles);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
