#include "worker/integrator/ray_batch.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/ray_batch.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/front_lanes-inl.h"
#include "worker/scene/bsdf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Samples i, i + 1, ... of a set, the rest without weight.
struct SampleLanes {
  VU code;
  VI site;
  VF weight;
  Vec3Lanes reflected;
};
HWY_INLINE SampleLanes LoadSamples(const CastSamples& in, std::size_t i) {
  const DF d;
  const DI di;
  const DU du;
  const std::size_t left = std::min(in.weight.size() - i, hn::Lanes(d));
  HWY_ALIGN std::int32_t site[hn::MaxLanes(DI())] = {};
  for (std::size_t lane = 0; lane < left; ++lane) site[lane] = in.site[i + lane];
  if (left == hn::Lanes(d)) {
    return {hn::LoadU(du, in.direction.data() + i),
            hn::Load(di, site),
            hn::LoadU(d, in.weight.data() + i),
            {hn::LoadU(d, in.r + i), hn::LoadU(d, in.g + i), hn::LoadU(d, in.b + i)}};
  }
  HWY_ALIGN OctDirection code[hn::MaxLanes(DU())] = {};
  HWY_ALIGN float part[4][hn::MaxLanes(DF())] = {};
  std::copy_n(in.direction.data() + i, left, code);
  std::copy_n(in.weight.data() + i, left, part[0]);
  std::copy_n(in.r + i, left, part[1]);
  std::copy_n(in.g + i, left, part[2]);
  std::copy_n(in.b + i, left, part[3]);
  return {hn::Load(du, code),
          hn::Load(di, site),
          hn::Load(d, part[0]),
          {hn::Load(d, part[1]), hn::Load(d, part[2]), hn::Load(d, part[3])}};
}

void CastRays(const CastSamples& in, const SiteOrigins& origins, RayBatch& batch,
              std::span<float> target) {
  const DF d;
  const DU du;
  std::size_t at = batch.size();
  ShadowRays& rays = batch.rays;
  for (std::size_t i = 0; i < in.weight.size(); i += hn::Lanes(d)) {
    const SampleLanes s = LoadSamples(in, i);

    // What each brings: u (f cos L) / p~.
    const VF p = MeanLanes(s.reflected);
    const MF live = hn::And(hn::Gt(p, hn::Set(d, 1e-37f)), hn::Gt(s.weight, hn::Zero(d)));
    const VF u = hn::Mul(s.weight, hn::Set(d, in.unit_contribution));
    const VF factor = hn::IfThenElseZero(live, hn::Div(u, hn::Max(p, hn::Set(d, 1e-37f))));
    const Vec3Lanes color = Scale(s.reflected, factor);
    const MF cast = hn::Gt(MeanLanes(color), hn::Zero(d));
    const std::size_t left = std::min(in.weight.size() - i, hn::Lanes(d));
    HWY_ALIGN float targets[hn::MaxLanes(DF())];
    hn::Store(p, d, targets);
    std::copy_n(targets, left, target.data() + i);

    // Keep those that bring something: they move to the front, whole vectors are stored, and the
    // next one covers the rest.
    std::size_t kept = 0;
    const auto front = FrontLanes(cast, kept);
    const auto put = [&](VF value, std::vector<float>& column) HWY_ATTR {
      hn::StoreU(hn::TableLookupLanes(value, front), d, column.data() + at);
    };
    const auto origin_of = [&](const SiteBlock::Array& table) HWY_ATTR {
      if (origins.num_sites == 1) return hn::Set(d, table[0]);
      return LookUp(table, s.site, origins.num_sites);
    };
    const Vec3Lanes w = DecodeOctahedral(s.code);
    put(origin_of(origins.x), rays.origin_x);
    put(origin_of(origins.y), rays.origin_y);
    put(origin_of(origins.z), rays.origin_z);
    put(w.x, rays.direction_x);
    put(w.y, rays.direction_y);
    put(w.z, rays.direction_z);
    const VF scale = hn::Set(d, in.picture_scale);
    put(hn::Mul(color.x, scale), batch.r);
    put(hn::Mul(color.y, scale), batch.g);
    put(hn::Mul(color.z, scale), batch.b);
    put(hn::Mul(s.weight, hn::Set(d, in.visibility_scale)), batch.visibility);
    const VF number = hn::BitCast(d, hn::Iota(du, in.first_sample + static_cast<std::uint32_t>(i)));
    hn::StoreU(hn::BitCast(du, hn::TableLookupLanes(number, front)), du, batch.sample.data() + at);
    at += kept;
  }
  rays.extend(at);
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(CastRays);

void RayBatch::reserve(std::size_t more) {
  constexpr std::size_t kPadding = 16;
  const std::size_t needed = size() + more + kPadding;
  if (needed <= sample.size()) return;
  const std::size_t capacity = std::max(needed, 2 * sample.size());
  rays.reserve(capacity);
  sample.resize(capacity);
  for (auto* column : {&r, &g, &b, &visibility}) column->resize(capacity);
}

void cast_samples(const CastSamples& samples, const SiteOrigins& origins, RayBatch& batch,
                  std::span<float> target) {
  BATON_CHECK(samples.direction.size() == samples.weight.size() &&
              samples.site.size() == samples.weight.size() &&
              target.size() == samples.weight.size());
  batch.reserve(samples.weight.size());
  HWY_DYNAMIC_DISPATCH(CastRays)(samples, origins, batch, target);
}

}  // namespace baton
#endif  // HWY_ONCE
