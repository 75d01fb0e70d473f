#include "worker/accel/surface_kernels.h"

#include <cstddef>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/accel/surface_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/math/exact_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE Vec3Lanes PointIn(const baton::Transform& t, const Vec3Lanes& v) {
  return Add(ExactTimes(t.linear, v), SetLanes(t.offset));
}
/// v or -v: that on the side of `to`.
HWY_INLINE Vec3Lanes TurnedTo(const Vec3Lanes& to, const Vec3Lanes& v) {
  const VF sign =
      hn::And(hn::SignBit(DF()), hn::VecFromMask(DF(), hn::Lt(ExactDot(v, to), hn::Zero(DF()))));
  return {hn::Xor(v.x, sign), hn::Xor(v.y, sign), hn::Xor(v.z, sign)};
}
/// lift_off() of one coordinate.
HWY_INLINE VF Lifted(VF position, VF normal, const Lift& lift) {
  const DF d;
  const DI di;
  const VI steps = hn::ConvertTo(di, hn::Mul(hn::Set(d, lift.steps), normal));
  const VI outward =
      hn::IfThenElse(hn::Lt(hn::BitCast(di, position), hn::Zero(di)), hn::Neg(steps), steps);
  const VF far = hn::BitCast(d, hn::Add(hn::BitCast(di, position), outward));
  const VF near = hn::Add(position, hn::Mul(hn::Set(d, lift.near), normal));
  return hn::IfThenElse(hn::Lt(hn::Abs(position), hn::Set(d, kLiftOrigin)), near, far);
}

HWY_INLINE Vec3Lanes Magnitude(const Vec3Lanes& v) {
  return {hn::Abs(v.x), hn::Abs(v.y), hn::Abs(v.z)};
}
/// lift_off().
HWY_INLINE Vec3Lanes LiftedOff(const Vec3Lanes& position, const Vec3Lanes& extent,
                               const Vec3Lanes& ng, const Lift& lift) {
  const DF d;
  const Vec3Lanes near{Lifted(position.x, ng.x, lift), Lifted(position.y, ng.y, lift),
                       Lifted(position.z, ng.z, lift)};
  const Vec3Lanes error = Add(Scale(extent, hn::Set(d, kPositionError)), SetLanes(lift.of_rays));
  const VF least = ExactDot(error, Magnitude(ng));
  const VF missing = hn::Sub(least, ExactDot(Sub(near, position), ng));
  return Add(near, Scale(ng, hn::Max(missing, hn::Zero(d))));
}

/// What three corners have, at the places that rays meet.
struct CornerWeights {
  VF a, b, c;

  CornerWeights(VF u, VF v) : a(hn::Sub(hn::Sub(hn::Set(DF(), 1.0f), u), v)), b(u), c(v) {}
  Vec3Lanes mean(const Vec3Lanes& of_a, const Vec3Lanes& of_b, const Vec3Lanes& of_c) const {
    return Add(Add(Scale(of_a, a), Scale(of_b, b)), Scale(of_c, c));
  }
};

/// Vectors of the corners of all lanes' triangles, each with a float that means nothing.
struct alignas(64) Corners {
  float at[3][kMaxRayGroup][4];

  void set(std::size_t corner, std::size_t lane, const Vec3& v) {
    std::memcpy(at[corner][lane], &v, sizeof(v));
  }
  /// One corner of the lanes from `lane` on.
  HWY_INLINE Vec3Lanes load(std::size_t corner, std::size_t lane) const {
    Records records;
    for (std::size_t k = 0; k < hn::Lanes(DF()); ++k) records[k] = at[corner][lane + k];
    const FourRows rows = LoadFour(records, 0);
    return {rows.row[0], rows.row[1], rows.row[2]};
  }
};

/// The first fields of hits are floats, and fill four blocks of four.
static_assert(offsetof(SurfaceHit, point) == 0 && sizeof(ShadingPoint) == 12 * sizeof(float) &&
              offsetof(ShadingPoint, ng) == 3 * sizeof(float) &&
              offsetof(ShadingPoint, ns) == 6 * sizeof(float) &&
              offsetof(ShadingPoint, wo) == 9 * sizeof(float) &&
              offsetof(SurfaceHit, ray_origin) == 12 * sizeof(float) &&
              offsetof(SurfaceHit, depth) == 15 * sizeof(float));
using HitsOfLanes = std::array<SurfaceHit*, hn::MaxLanes(DF())>;

/// Writes four fields of the hits of all lanes.
HWY_INLINE void StoreFields(const HitsOfLanes& hits, std::size_t first_field, VF f0, VF f1, VF f2,
                            VF f3) {
  const FourRows blocks = TransposeBlocks(f0, f1, f2, f3);
  for (std::size_t k = 0; k < 4; ++k) {
    StoreBlocks(DF(), blocks.row[k], [&](std::size_t block) HWY_ATTR {
      return &hits[4 * block + k]->point.position.x + first_field;
    });
  }
}

void SeeSurfaces(const kernels::MetTriangles& met, std::size_t first, const Instance& instance,
                 std::span<const std::array<std::uint32_t, 3>> triangles,
                 const MeshVertices& vertices, const Lift& lift, bool with_place,
                 std::span<SurfaceHit> hits) {
  const bool is_smooth = !vertices.normals.empty();
  const std::uint32_t index = met.instance[first];
  const std::size_t lanes = hn::Lanes(DF());
  const std::size_t begin = first / lanes * lanes, end = (met.count + lanes - 1) / lanes * lanes;
  const auto is_here = [&](std::size_t lane) {
    return lane < met.count && met.instance[lane] == index;
  };

  // Copy the corners. Lanes that met something else have those of the first one.
  Corners positions, normals;
  for (std::size_t lane = begin; lane < end; ++lane) {
    const auto& corner = triangles[met.triangle[is_here(lane) ? lane : first]];
    for (std::size_t c = 0; c < 3; ++c) {
      positions.set(c, lane, vertices.positions[corner[c]]);
      if (is_smooth) normals.set(c, lane, vertices.normals[corner[c]]);
    }
  }

  SurfaceHit unused;
  for (std::size_t lane = begin; lane < end; lane += lanes) {
    const DF d;
    const Vec3Lanes wo{hn::Neg(hn::LoadU(d, &met.direction_x[lane])),
                       hn::Neg(hn::LoadU(d, &met.direction_y[lane])),
                       hn::Neg(hn::LoadU(d, &met.direction_z[lane]))};
    const CornerWeights weights(hn::LoadU(d, &met.u[lane]), hn::LoadU(d, &met.v[lane]));
    const Vec3Lanes a = PointIn(instance.to_world, positions.load(0, lane));
    const Vec3Lanes b = PointIn(instance.to_world, positions.load(1, lane));
    const Vec3Lanes c = PointIn(instance.to_world, positions.load(2, lane));
    const Vec3Lanes position = weights.mean(a, b, c);
    const Vec3Lanes ng = TurnedTo(wo, ExactNormalize(ExactCross(Sub(b, a), Sub(c, a))));
    Vec3Lanes ns = ng;
    if (is_smooth) {
      const Vec3Lanes normal =
          weights.mean(normals.load(0, lane), normals.load(1, lane), normals.load(2, lane));
      ns = TurnedTo(ng, ExactNormalize(ExactTimes(instance.normal_to_world, normal)));
      ns = Select(hn::Gt(ExactDot(ns, ng), hn::Zero(d)), ns, ng);
    }
    const Vec3Lanes extent = weights.mean(Magnitude(a), Magnitude(b), Magnitude(c));
    const Vec3Lanes origin = LiftedOff(position, extent, ng, lift);

    // Write them as records.
    HitsOfLanes out;
    for (std::size_t k = 0; k < lanes; ++k) {
      const std::size_t at = lane + k;
      SurfaceHit& hit = is_here(at) ? hits[at] : unused;
      hit.instance = index;
      hit.material = instance.material;
      hit.hit = true;
      hit.is_catcher = instance.is_catcher;
      hit.place =
          with_place ? SurfacePlace{met.triangle[at], met.u[at], met.v[at]} : SurfacePlace{};
      out[k] = &hit;
    }
    StoreFields(out, 0, position.x, position.y, position.z, ng.x);
    StoreFields(out, 4, ng.y, ng.z, ns.x, ns.y);
    StoreFields(out, 8, ns.z, wo.x, wo.y, wo.z);
    StoreFields(out, 12, origin.x, origin.y, origin.z, hn::LoadU(d, &met.depth[lane]));
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(SeeSurfaces);

namespace kernels {

void see_surfaces(const MetTriangles& met, std::size_t first, const Instance& instance,
                  std::span<const std::array<std::uint32_t, 3>> triangles,
                  const MeshVertices& vertices, const Lift& lift, bool with_place,
                  std::span<SurfaceHit> hits) {
  HWY_DYNAMIC_DISPATCH(SeeSurfaces)
  (met, first, instance, triangles, vertices, lift, with_place, hits);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
