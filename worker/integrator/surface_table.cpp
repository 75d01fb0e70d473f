#include "worker/integrator/surface_table.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/surface_table.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/target-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE void StoreSomeFloats(VF value, std::vector<float>& array, std::size_t i) {
  const DF d;
  HWY_ALIGN float out[hn::MaxLanes(DF())];
  hn::Store(value, d, out);
  std::copy_n(out, std::min(array.size() - i, hn::Lanes(d)), array.data() + i);
}

/// The fields of one vector of surfaces or lights, one row a field. Copying lane by lane beats
/// gathers.
template <int kFields>
struct Columns {
  alignas(64) float value[kFields][hn::MaxLanes(DF())];
  HWY_INLINE VF Row(int field) const { return hn::Load(DF(), value[field]); }
};

HWY_INLINE SurfaceLanes LoadTable(const SurfaceTable& table, std::span<const std::int32_t> surface,
                                  std::size_t i, Columns<SurfaceTable::kStride>& columns) {
  const DF d;
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    const auto at = static_cast<std::size_t>(surface[std::min(i + lane, surface.size() - 1)]);
    const float* record = table.data() + at * SurfaceTable::kStride;
    for (int f = 0; f < SurfaceTable::origin; ++f) columns.value[f][lane] = record[f];
  }
  const auto field = [&](int at) HWY_ATTR { return columns.Row(at); };
  const auto vec = [&](int at) HWY_ATTR {
    return Vec3Lanes{field(at), field(at + 1), field(at + 2)};
  };
  const VF kind = field(SurfaceTable::is_ggx);  // 0, 1, or 1 + table
  return {.ns = vec(SurfaceTable::ns),
          .ng = vec(SurfaceTable::ng),
          .wo = vec(SurfaceTable::wo),
          .mirror = vec(SurfaceTable::mirror),
          .kd = vec(SurfaceTable::kd),
          .ks = vec(SurfaceTable::ks),
          .shape = field(SurfaceTable::shape),
          .lobe_scale = field(SurfaceTable::lobe_scale),
          .specular_probability = hn::Zero(d),
          .is_ggx = hn::Gt(kind, hn::Zero(d)),
          .any_phong = table.any_phong(),
          .any_ggx = table.any_ggx(),
          .any_measured = table.tables().size() > 1,
          .tables = table.tables().data(),
          .table = hn::ConvertTo(DI(), hn::Max(hn::Sub(kind, hn::Set(d, 1.0f)), hn::Zero(d)))};
}

void ReflectSamples(const SurfaceTable& surfaces, const LightSamples& samples,
                    std::span<const std::int32_t> surface, std::span<const std::int32_t> light,
                    ReflectedSamples& out) {
  const DF d;
  Columns<SurfaceTable::kStride> columns;
  Columns<6> lights;
  for (std::size_t i = 0; i < surface.size(); i += hn::Lanes(d)) {
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      const auto j = static_cast<std::size_t>(light[std::min(i + lane, light.size() - 1)]);
      const float fields[] = {samples.x[j], samples.y[j], samples.z[j],
                              samples.r[j], samples.g[j], samples.b[j]};
      for (int f = 0; f < 6; ++f) lights.value[f][lane] = fields[f];
    }
    const SurfaceLanes s = LoadTable(surfaces, surface, i, columns);
    const BsdfLanes f = EvaluateBsdf(s, {lights.Row(0), lights.Row(1), lights.Row(2)});
    const Vec3Lanes reflected =
        ReflectedRadiance(s, f, lights.Row(3), lights.Row(4), lights.Row(5));
    StoreSomeFloats(reflected.x, out.r, i);
    StoreSomeFloats(reflected.y, out.g, i);
    StoreSomeFloats(reflected.z, out.b, i);
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ReflectSamples);

void SurfaceTable::add(const ShadingPoint& point, const Material& material,
                       const Vec3& ray_origin) {
  SiteBlock one;
  one.clear(1);
  one.add(0, point, material);
  if (one.any_measured) {
    const auto found = std::find(tables_.begin(), tables_.end(), one.measured[0]);
    one.is_ggx[0] = 1 + static_cast<float>(found - tables_.begin());
    if (found == tables_.end()) tables_.push_back(one.measured[0]);
  }
  for (const SiteBlock::Array* field :
       {&one.ns_x,  &one.ns_y,       &one.ns_z,  &one.ng_x,     &one.ng_y,     &one.ng_z,
        &one.wo_x,  &one.wo_y,       &one.wo_z,  &one.mirror_x, &one.mirror_y, &one.mirror_z,
        &one.kd_r,  &one.kd_g,       &one.kd_b,  &one.ks_r,     &one.ks_g,     &one.ks_b,
        &one.shape, &one.lobe_scale, &one.is_ggx}) {
    records_.push_back((*field)[0]);
  }
  records_.insert(records_.end(), {ray_origin.x, ray_origin.y, ray_origin.z});
  any_phong_ = any_phong_ || one.any_phong;
  any_ggx_ = any_ggx_ || one.any_ggx;
}

namespace kernels {

void reflect_samples(const SurfaceTable& surfaces, const LightSamples& samples,
                     std::span<const std::int32_t> surface, std::span<const std::int32_t> light,
                     ReflectedSamples& out) {
  BATON_CHECK(surface.size() == light.size() && out.r.size() == surface.size());
  if (surface.empty()) return;
  HWY_DYNAMIC_DISPATCH(ReflectSamples)(surfaces, samples, surface, light, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
