#include "worker/integrator/exchange_kernels.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "worker/integrator/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/exchange_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/target-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

static_assert(sizeof(LightRecord) == 8 * sizeof(float) && sizeof(Reflected) == 4 * sizeof(float));

/// The records of one vector of surfaces or lights, one a lane.
using Records = std::array<const float*, 8>;

/// Four floats of the records k, k + 4, ..., block after block of a vector.
template <class D>
HWY_INLINE hn::Vec<D> LoadBlocks(D d, const float* const* record, int field) {
  if constexpr (hn::MaxLanes(D()) > 4) {
    const hn::Half<D> half;
    return hn::Combine(d, LoadBlocks(half, record + 4, field), LoadBlocks(half, record, field));
  } else {
    return hn::LoadU(d, *record + field);
  }
}

/// Fields first, ..., first + 3 of every record, a row each: 4 x 4 transposes in registers, which
/// beat gathers and copies lane by lane.
struct FourRows {
  VF row[4];
};
HWY_INLINE FourRows LoadFour(const Records& records, int first) {
  static_assert(hn::MaxLanes(DF()) == 4 || hn::MaxLanes(DF()) == 8);
  const DF d;
  const VF a = LoadBlocks(d, &records[0], first);
  const VF b = LoadBlocks(d, &records[1], first);
  const VF c = LoadBlocks(d, &records[2], first);
  const VF e = LoadBlocks(d, &records[3], first);
  const VF ac_low = hn::InterleaveLower(d, a, c);
  const VF be_low = hn::InterleaveLower(d, b, e);
  const VF ac_high = hn::InterleaveUpper(d, a, c);
  const VF be_high = hn::InterleaveUpper(d, b, e);
  return {{hn::InterleaveLower(d, ac_low, be_low), hn::InterleaveUpper(d, ac_low, be_low),
           hn::InterleaveLower(d, ac_high, be_high), hn::InterleaveUpper(d, ac_high, be_high)}};
}

/// The surfaces of one vector; of diffuse ones only half of the records is read.
HWY_INLINE SurfaceLanes LoadTable(const SurfaceTable& table, const Records& records) {
  const DF d;
  const VF zero = hn::Zero(d);
  const FourRows a = LoadFour(records, SurfaceTable::ns);
  const FourRows b = LoadFour(records, SurfaceTable::ng);
  const FourRows c = LoadFour(records, SurfaceTable::kd);
  SurfaceLanes s;  // filled field by field: as an aggregate GCC clears it first
  s.ns = {a.row[0], a.row[1], a.row[2]};
  s.lobe_scale = a.row[3];
  s.ng = {b.row[0], b.row[1], b.row[2]};
  s.is_ggx = hn::Gt(b.row[3], zero);
  s.kd = {c.row[0], c.row[1], c.row[2]};
  s.shape = c.row[3];
  s.wo = s.mirror = s.ks = {zero, zero, zero};
  s.specular_probability = zero;
  s.any_phong = !hn::AllFalse(d, hn::AndNot(s.is_ggx, hn::Gt(s.lobe_scale, zero)));
  s.any_ggx = !hn::AllFalse(d, s.is_ggx);
  s.any_measured = false;
  s.tables = table.tables().data();
  s.table = hn::Zero(DI());
  if (!s.any_phong && !s.any_ggx) return s;
  const FourRows e = LoadFour(records, SurfaceTable::origin);
  const FourRows f = LoadFour(records, SurfaceTable::wo);
  const FourRows g = LoadFour(records, SurfaceTable::mirror);
  s.wo = {f.row[0], f.row[1], f.row[2]};
  s.mirror = {g.row[0], g.row[1], g.row[2]};
  s.ks = {e.row[3], f.row[3], g.row[3]};
  s.any_measured = table.tables().size() > 1 && s.any_ggx;
  s.table = hn::ConvertTo(DI(), hn::Max(hn::Sub(b.row[3], hn::Set(d, 1.0f)), zero));
  return s;
}

/// Where the surfaces and lights of the vector from pair i on lie; past the end the last one again.
struct PairRecords {
  Records surface, light;
};
HWY_INLINE PairRecords FindRecords(const SurfaceTable& surfaces,
                                   std::span<const LightRecord> lights,
                                   std::span<const LitSurface> pairs, std::size_t i) {
  PairRecords records;
  const auto* first_light = reinterpret_cast<const float*>(lights.data());
  for (std::size_t lane = 0; lane < hn::Lanes(DF()); ++lane) {
    const LitSurface& pair = pairs[std::min(i + lane, pairs.size() - 1)];
    records.surface[lane] =
        surfaces.data() + static_cast<std::ptrdiff_t>(pair.surface) * SurfaceTable::kStride;
    records.light[lane] = first_light + static_cast<std::ptrdiff_t>(pair.light) * 8;
  }
  return records;
}

void LookUpLights(const EnvironmentView& environment, std::span<const OctDirection> code,
                  std::span<LightRecord> lights) {
  const DF d;
  HWY_ALIGN std::uint32_t some[hn::MaxLanes(DU())] = {};
  HWY_ALIGN float low[4 * hn::MaxLanes(DF())], high[4 * hn::MaxLanes(DF())];
  for (std::size_t i = 0; i < code.size(); i += hn::Lanes(d)) {
    const std::size_t count = std::min(hn::Lanes(d), code.size() - i);
    std::copy_n(code.data() + i, count, some);
    const Vec3Lanes w = DecodeOctahedral(hn::Load(DU(), some));
    const RadianceLanes light = EvaluateEnvironment(environment, w);
    hn::StoreInterleaved4(w.x, w.y, w.z, light.r, d, low);
    hn::StoreInterleaved4(light.g, light.b, hn::Zero(d), hn::Zero(d), d, high);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const float* a = low + 4 * lane;
      const float* b = high + 4 * lane;
      lights[i + lane] = {{a[0], a[1], a[2]}, {a[3], b[0], b[1]}};
    }
  }
}

void ReflectLights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                   std::span<const LitSurface> pairs, std::span<Reflected> reflected) {
  const DF d;
  auto* out = reinterpret_cast<float*>(reflected.data());
  for (std::size_t i = 0; i < pairs.size(); i += hn::Lanes(d)) {
    const PairRecords records = FindRecords(surfaces, lights, pairs, i);
    const SurfaceLanes s = LoadTable(surfaces, records.surface);
    const FourRows low = LoadFour(records.light, 0);
    const FourRows high = LoadFour(records.light, 4);
    const BsdfLanes f = EvaluateBsdf(s, {low.row[0], low.row[1], low.row[2]});
    const Vec3Lanes rgb = ReflectedRadiance(s, f, low.row[3], high.row[0], high.row[1]);
    hn::StoreInterleaved4(rgb.x, rgb.y, rgb.z, MeanLanes(rgb), d, out + 4 * i);
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(LookUpLights);
HWY_EXPORT(ReflectLights);

namespace kernels {

void look_up_lights(const EnvironmentView& environment, std::span<const OctDirection> code,
                    std::span<LightRecord> lights) {
  BATON_CHECK(lights.size() >= code.size());
  HWY_DYNAMIC_DISPATCH(LookUpLights)(environment, code, lights);
}

void reflect_lights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                    std::span<const LitSurface> pairs, std::span<Reflected> reflected) {
  BATON_CHECK(reflected.size() >= pairs.size() + kPadding);
  HWY_DYNAMIC_DISPATCH(ReflectLights)(surfaces, lights, pairs, reflected);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
