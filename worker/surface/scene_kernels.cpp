#include "worker/surface/scene_kernels.h"

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/surface/scene_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/surface/bsdf-inl.h"
#include "worker/surface/environment-inl.h"

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

void SeeEnvironmentSpans(const EnvironmentView& view, std::span<const float> x,
                         std::span<const float> y, std::span<const float> z, std::span<float> r,
                         std::span<float> g, std::span<float> b) {
  for (std::size_t i = 0; i < x.size(); i += hn::Lanes(DF())) {
    const Vec3Lanes w{LoadSome(x, i), LoadSome(y, i), LoadSome(z, i)};
    const RadianceLanes light = SeenTexels(view, LocateTexels(view, w));
    StoreSome(light.r, r, i);
    StoreSome(light.g, g, i);
    StoreSome(light.b, b, i);
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

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(DecodeDirections);
HWY_EXPORT(EvaluateEnvironmentSpans);
HWY_EXPORT(SeeEnvironmentSpans);
HWY_EXPORT(EvaluateBsdfSpans);
HWY_EXPORT(SampleBsdfSpans);
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

void see_environment(const EnvironmentView& view, std::span<const float> x,
                     std::span<const float> y, std::span<const float> z, std::span<float> r,
                     std::span<float> g, std::span<float> b) {
  HWY_DYNAMIC_DISPATCH(SeeEnvironmentSpans)(view, x, y, z, r, g, b);
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

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
