#include "worker/method/ray_batch.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/ray_batch.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/math/front_lanes-inl.h"
#include "worker/surface/bsdf-inl.h"

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
  const std::size_t n = in.weight.size();
  const auto color = [&](const float* c) HWY_ATTR { return LoadSome(std::span(c, n), i); };
  return {LoadSome(DU(), in.direction, i),
          LoadBytes(in.site, i),
          LoadSome(in.weight, i),
          {color(in.r), color(in.g), color(in.b)}};
}

HWY_INLINE Vec3Lanes OriginsOf(const SiteOrigins& origins, VI site) {
  const DF d;
  if (origins.num_sites == 1) {
    return {hn::Set(d, origins.x[0]), hn::Set(d, origins.y[0]), hn::Set(d, origins.z[0])};
  }
  return {LookUp(origins.x, site, origins.num_sites), LookUp(origins.y, site, origins.num_sites),
          LookUp(origins.z, site, origins.num_sites)};
}

void CastRays(const PixelRays& in, const SiteOrigins& origins, RayBatch& batch) {
  const DF d;
  const DU du;
  const std::size_t first = batch.size();
  ShadowRays& rays = batch.rays;
  for (std::size_t i = 0; i < in.count; i += hn::Lanes(d)) {
    const auto put = [&](VF value, std::vector<float>& column)
                         HWY_ATTR { hn::StoreU(value, d, column.data() + first + i); };
    const Vec3Lanes from =
        OriginsOf(origins, hn::PromoteTo(DI(), hn::LoadU(DB(), in.site.from(i))));
    put(from.x, rays.origin_x);
    put(from.y, rays.origin_y);
    put(from.z, rays.origin_z);
    put(hn::Load(d, in.x.from(i)), rays.direction_x);
    put(hn::Load(d, in.y.from(i)), rays.direction_y);
    put(hn::Load(d, in.z.from(i)), rays.direction_z);
    put(hn::Load(d, in.r.from(i)), batch.r);
    put(hn::Load(d, in.g.from(i)), batch.g);
    put(hn::Load(d, in.b.from(i)), batch.b);
    put(hn::Load(d, in.visibility.from(i)), batch.visibility);
    const VU number = CountFrom(du, static_cast<std::uint32_t>(i));
    hn::StoreU(number, du, batch.sample.data() + first + i);
  }
  std::copy_n(in.tag.from(0), in.count, batch.tag.data() + first);
  rays.extend(first + in.count);
}

void CastSampleRays(const CastSamples& in, const SiteOrigins& origins, RayBatch& batch,
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
    StoreSome(p, target, i);

    // Keep those that bring something: they move to the front, whole vectors are stored, and the
    // next one covers the rest.
    std::size_t kept = 0;
    const auto front = FrontLanes(cast, kept);
    const auto put = [&](VF value, std::vector<float>& column) HWY_ATTR {
      hn::StoreU(hn::TableLookupLanes(value, front), d, column.data() + at);
    };
    const Vec3Lanes from = OriginsOf(origins, s.site);
    const Vec3Lanes w = DecodeOctahedral(s.code);
    put(from.x, rays.origin_x);
    put(from.y, rays.origin_y);
    put(from.z, rays.origin_z);
    put(w.x, rays.direction_x);
    put(w.y, rays.direction_y);
    put(w.z, rays.direction_z);
    const VF scale = hn::Set(d, in.image_scale);
    put(hn::Mul(color.x, scale), batch.r);
    put(hn::Mul(color.y, scale), batch.g);
    put(hn::Mul(color.z, scale), batch.b);
    put(hn::Mul(s.weight, hn::Set(d, in.visibility_scale)), batch.visibility);
    const VF number =
        hn::BitCast(d, CountFrom(du, in.first_sample + static_cast<std::uint32_t>(i)));
    hn::StoreU(hn::BitCast(du, hn::TableLookupLanes(number, front)), du, batch.sample.data() + at);
    at += kept;
  }
  rays.extend(at);
}

FreeLight SumFree(const RayBatch& batch, std::size_t first, std::size_t end) {
  const DF d;
  const auto load = [&](const std::vector<float>& column, std::size_t i)
                        HWY_ATTR { return hn::LoadU(d, column.data() + first + i); };
  Vec3Lanes color{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  Vec3Lanes blocked = color;
  VF visibility = hn::Zero(d);
  FreeLight out;
  const std::size_t count = end - first;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    MF hit = hn::Lt(load(batch.rays.t_far, i), hn::Zero(d));
    MF free = hn::Not(hit);
    if (i + hn::Lanes(d) > count) {
      const MF is_ray = hn::FirstN(d, count - i);
      free = hn::And(free, is_ray);
      hit = hn::And(hit, is_ray);
    }
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, free, bits);
    out.is_free |= std::uint64_t{bits[0]} << i;
    const Vec3Lanes value{load(batch.r, i), load(batch.g, i), load(batch.b, i)};
    const auto of = [&](MF mask) HWY_ATTR -> Vec3Lanes {
      return {hn::IfThenElseZero(mask, value.x), hn::IfThenElseZero(mask, value.y),
              hn::IfThenElseZero(mask, value.z)};
    };
    color = Add(color, of(free));
    blocked = Add(blocked, of(hit));
    visibility = hn::Add(visibility, hn::IfThenElseZero(free, load(batch.visibility, i)));
  }
  out.color = SumOfLanes(color);
  out.blocked = SumOfLanes(blocked);
  out.visibility = hn::GetLane(hn::SumOfLanes(d, visibility));
  return out;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(CastSampleRays);
HWY_EXPORT(CastRays);
HWY_EXPORT(SumFree);

void RayBatch::reserve(std::size_t more) {
  const std::size_t needed = size() + more + kVectorPadding;
  if (needed <= sample.size()) return;
  const std::size_t capacity = std::max(needed, 2 * sample.size());
  rays.reserve(capacity);
  sample.resize(capacity);
  tag.resize(capacity);
  for (auto* column : {&r, &g, &b, &visibility}) column->resize(capacity);
}

void cast_rays(const PixelRays& rays, const SiteOrigins& origins, RayBatch& batch) {
  batch.reserve(rays.count);
  HWY_DYNAMIC_DISPATCH(CastRays)(rays, origins, batch);
}

void cast_samples(const CastSamples& samples, const SiteOrigins& origins, RayBatch& batch,
                  std::span<float> target) {
  BATON_CHECK(samples.direction.size() == samples.weight.size() &&
              samples.site.size() == samples.weight.size() &&
              target.size() == samples.weight.size());
  batch.reserve(samples.weight.size());
  HWY_DYNAMIC_DISPATCH(CastSampleRays)(samples, origins, batch, target);
}

FreeLight sum_free(const RayBatch& batch, std::size_t first, std::size_t end) {
  BATON_CHECK(first <= end && end - first <= 64 && end <= batch.size());
  return HWY_DYNAMIC_DISPATCH(SumFree)(batch, first, end);
}

}  // namespace baton
#endif  // HWY_ONCE
