#include "worker/exchange/exchange_kernels.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "common/base/poison.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/exchange/exchange_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/math/front_lanes-inl.h"
#include "worker/surface/bsdf-inl.h"
#include "worker/surface/environment-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

static_assert(sizeof(LightRecord) == 8 * sizeof(float) && sizeof(Reflected) == 4 * sizeof(float));

/// The surfaces of one vector, their common records given; of diffuse ones only those are read.
HWY_INLINE SurfaceLanes LoadTable(const SurfaceTable& table, const Records& common, VF ks_r) {
  const DF d;
  const VF zero = hn::Zero(d);
  const FourRows a = LoadFour(common, SurfaceTable::ns);
  const FourRows b = LoadFour(common, SurfaceTable::ng);
  const FourRows c = LoadFour(common, SurfaceTable::kd);
  SurfaceLanes s;  // filled field by field: as an aggregate GCC clears it first
  s.ns = {a.row[0], a.row[1], a.row[2]};
  s.lobe_scale = a.row[3];
  s.ng = {b.row[0], b.row[1], b.row[2]};
  s.is_ggx = hn::Gt(b.row[3], zero);
  s.kd = {c.row[0], c.row[1], c.row[2]};
  s.shape = c.row[3];
  SetZero(s.wo);
  SetZero(s.mirror);
  SetZero(s.ks);
  s.specular_probability = zero;
  s.any_phong = !hn::AllFalse(d, hn::AndNot(s.is_ggx, hn::Gt(s.lobe_scale, zero)));
  s.any_ggx = !hn::AllFalse(d, s.is_ggx);
  s.any_measured = false;
  s.tables = table.tables().data();
  s.table = s.site = hn::Zero(DI());
  s.alpha2 = s.view_cosine = s.view_masking = zero;
  s.any_lobe = s.any_phong || s.any_ggx;
  s.any_coat = false;
  if (!s.any_lobe) return s;
  Records glossy;
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane)
    glossy[lane] = table.glossy() + (common[lane] - table.common()) / 2;
  const FourRows f = LoadFour(glossy, 0);
  const FourRows g = LoadFour(glossy, SurfaceTable::mirror - SurfaceTable::wo);
  s.wo = {f.row[0], f.row[1], f.row[2]};
  s.mirror = {g.row[0], g.row[1], g.row[2]};
  s.ks = {ks_r, f.row[3], g.row[3]};
  if (s.any_ggx) {
    GgxLanes lobe{s.ns, s.wo, s.shape, zero, zero, zero};
    SetViewTerms(lobe);
    s.alpha2 = lobe.alpha2;
    s.view_cosine = lobe.view_cosine;
    s.view_masking = lobe.view_masking;
  }
  s.any_measured = table.tables().size() > 1 && s.any_ggx;
  s.table = hn::ConvertTo(DI(), hn::Max(hn::Sub(b.row[3], hn::Set(d, 1.0f)), zero));
  if (table.coats() == nullptr) return s;
  Records coats;
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane)
    coats[lane] = table.coats() + (common[lane] - table.common()) / 2;
  const FourRows m = LoadFour(coats, 0);
  const FourRows n = LoadFour(coats, 4);
  s.coat.ns = {m.row[0], m.row[1], m.row[2]};
  s.coat.alpha = m.row[3];
  s.coat.wo = {n.row[0], n.row[1], n.row[2]};
  s.coat_share = n.row[3];
  s.coat_chance = zero;
  SetViewTerms(s.coat);
  s.any_coat = !hn::AllFalse(d, hn::Gt(s.coat_share, zero));
  return s;
}
static_assert(SurfaceTable::kGlossy * 2 == SurfaceTable::kCommon);

/// The surfaces of the vector from offer i on; past the end the last one again. Asks for them
/// early.
HWY_INLINE Records FindSurfaces(const SurfaceTable& surfaces, std::span<const Offer> offers,
                                std::size_t i) {
  Records records;
  for (std::size_t lane = 0; lane < hn::Lanes(DF()); ++lane) {
    const Offer& offer = offers[std::min(i + lane, offers.size() - 1)];
    records[lane] = surfaces.common() + std::size_t{offer.surface} * SurfaceTable::kCommon;
    hwy::Prefetch(records[lane]);
  }
  return records;
}
HWY_INLINE Records FindLights(std::span<const LightRecord> lights, std::span<const Offer> offers,
                              std::size_t i) {
  Records records;
  const auto* first = reinterpret_cast<const float*>(lights.data());
  for (std::size_t lane = 0; lane < hn::Lanes(DF()); ++lane)
    records[lane] = first + std::size_t{offers[std::min(i + lane, offers.size() - 1)].sample} * 8;
  return records;
}

/// Looks up some vectors of directions: prefetches all texels, then reads them.
void LookUpLights(const EnvironmentView& environment, std::span<const OctDirection> code,
                  std::span<LightRecord> lights) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kVectors = 8;
  for (std::size_t first = 0; first < code.size(); first += kVectors * lanes) {
    Vec3Lanes w[kVectors];
    TexelLanes at[kVectors];
    const std::size_t vectors = std::min(kVectors, (code.size() - first + lanes - 1) / lanes);
    for (std::size_t v = 0; v < vectors; ++v) {
      w[v] = DecodeOctahedral(LoadSome(DU(), code, first + v * lanes));
      at[v] = LocateTexels(environment, w[v]);
      PrefetchTexels(environment, at[v]);
    }
    for (std::size_t v = 0; v < vectors; ++v) {
      HWY_ALIGN float low[4 * hn::MaxLanes(DF())], high[4 * hn::MaxLanes(DF())];
      const RadianceLanes light = EvaluateTexels(environment, at[v]);
      hn::StoreInterleaved4(w[v].x, w[v].y, w[v].z, light.r, d, low);
      hn::StoreInterleaved4(light.g, light.b, hn::Zero(d), hn::Zero(d), d, high);
      const std::size_t i = first + v * lanes;
      for (std::size_t lane = 0; lane < std::min(lanes, code.size() - i); ++lane) {
        const float* a = low + 4 * lane;
        const float* b = high + 4 * lane;
        lights[i + lane] = {{a[0], a[1], a[2]}, {a[3], b[0], b[1]}};
      }
    }
  }
}

/// Reflects, vector by vector; then(i, from, w, target) is told the origins of the surfaces, the
/// directions and what came of it.
template <class Then>
HWY_INLINE void ReflectEach(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                            std::span<const Offer> offers, std::span<Reflected> reflected,
                            const Then& then) {
  const DF d;
  if (offers.empty()) return;
  auto* out = reinterpret_cast<float*>(reflected.data());
  Records next = FindSurfaces(surfaces, offers, 0);
  for (std::size_t i = 0; i < offers.size(); i += hn::Lanes(d)) {
    const Records common = next;
    next = FindSurfaces(surfaces, offers, i + hn::Lanes(d));
    const FourRows from = LoadFour(common, SurfaceTable::origin);
    const SurfaceLanes s = LoadTable(surfaces, common, from.row[3]);
    const Records light = FindLights(lights, offers, i);
    const FourRows low = LoadFour(light, 0);
    const FourRows high = LoadFour(light, 4);
    const Vec3Lanes w = {low.row[0], low.row[1], low.row[2]};
    const BsdfLanes f = EvaluateBsdf(s, w);
    const Vec3Lanes rgb = ReflectedRadiance(s, f, low.row[3], high.row[0], high.row[1]);
    const VF target = MeanLanes(rgb);
    hn::StoreInterleaved4(rgb.x, rgb.y, rgb.z, target, d, out + 4 * i);
    then(i, Vec3Lanes{from.row[0], from.row[1], from.row[2]}, w, target);
  }
}

void ReflectLights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                   std::span<const Offer> offers, std::span<Reflected> reflected) {
  ReflectEach(surfaces, lights, offers, reflected,
              [](std::size_t, const Vec3Lanes&, const Vec3Lanes&, VF) HWY_ATTR {});
}

void ReflectAndCast(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                    std::span<const Offer> offers, std::span<Reflected> reflected, OfferRays& out) {
  const DF d;
  const DI di;
  const DU du;
  ShadowRays& rays = out.rays;
  std::size_t at = 0;
  const auto cast = [&](std::size_t i, const Vec3Lanes& from, const Vec3Lanes& w,
                        VF target) HWY_ATTR {
    // Those that reflect something move to the front, whole vectors are stored, and the next one
    // covers the rest.
    const VI number = CountFrom(di, static_cast<std::int32_t>(i));
    const VI count = hn::Set(di, static_cast<std::int32_t>(offers.size()));
    const MF wanted =
        hn::And(hn::Gt(target, hn::Zero(d)), hn::RebindMask(d, hn::Gt(count, number)));
    std::size_t kept = 0;
    const auto front = FrontLanes(wanted, kept);
    const auto put = [&](VF value, std::vector<float>& column) HWY_ATTR {
      hn::StoreU(hn::TableLookupLanes(value, front), d, column.data() + at);
    };
    put(from.x, rays.origin_x);
    put(from.y, rays.origin_y);
    put(from.z, rays.origin_z);
    put(w.x, rays.direction_x);
    put(w.y, rays.direction_y);
    put(w.z, rays.direction_z);
    hn::StoreU(hn::BitCast(du, hn::TableLookupLanes(hn::BitCast(d, number), front)), du,
               out.offer.data() + at);
    at += kept;
  };
  ReflectEach(surfaces, lights, offers, reflected, cast);
  rays.extend(at);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(LookUpLights);
HWY_EXPORT(ReflectLights);
HWY_EXPORT(ReflectAndCast);

namespace kernels {

void look_up_lights(const EnvironmentView& environment, std::span<const OctDirection> code,
                    std::span<LightRecord> lights) {
  BATON_CHECK(lights.size() >= code.size());
  HWY_DYNAMIC_DISPATCH(LookUpLights)(environment, code, lights);
}

void reflect_lights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                    std::span<const Offer> offers, std::span<Reflected> reflected) {
  BATON_CHECK(reflected.size() >= offers.size() + kReceptionPadding);
  HWY_DYNAMIC_DISPATCH(ReflectLights)(surfaces, lights, offers, reflected);
}

void reflect_and_cast(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                      std::span<const Offer> offers, std::span<Reflected> reflected,
                      OfferRays& rays) {
  const std::size_t capacity = offers.size() + kReceptionPadding;
  BATON_CHECK(reflected.size() >= capacity);
  rays.rays.clear();
  rays.rays.reserve(capacity);
  rays.offer.resize(std::max(rays.offer.size(), capacity));
  poison(rays.offer);
  HWY_DYNAMIC_DISPATCH(ReflectAndCast)(surfaces, lights, offers, reflected, rays);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
