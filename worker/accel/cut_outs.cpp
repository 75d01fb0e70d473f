#include "worker/accel/cut_outs.h"

#include <algorithm>
#include <bit>

#include "common/math/murmur3.h"
#include "worker/surface/seen_surface.h"

namespace baton {

std::set<std::uint32_t> meshes_with_holes(const Scene& scene) {
  std::set<std::uint32_t> meshes;
  for (const Instance& instance : scene.instances) {
    const auto& detail = scene.material_of(instance).detail;
    if (detail != nullptr && detail->is_cut_out()) meshes.insert(instance.mesh);
  }
  return meshes;
}

bool any_blends(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const Material& material) {
    return material.detail != nullptr && material.detail->spec.alpha_blend;
  });
}

std::uint32_t ray_bits(const Vec3& origin, const Vec3& direction) {
  std::uint32_t bits = 0;
  for (const float x : {origin.x, origin.y, origin.z, direction.x, direction.y, direction.z})
    bits = murmur3::added(bits, std::bit_cast<std::uint32_t>(x));
  return bits;
}

void pass_through_holes(const RTCFilterFunctionNArguments* args) {
  const auto& scene = *static_cast<const Scene*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    // Meshes with a hierarchy of their own are placed as the instance of that number.
    const unsigned placed = RTCHitN_instID(args->hit, args->N, i, 0);
    const unsigned index =
        placed != RTC_INVALID_GEOMETRY_ID ? placed : RTCHitN_geomID(args->hit, args->N, i);
    const Instance& instance = scene.instances[index];
    const auto& detail = scene.material_of(instance).detail;
    if (detail == nullptr || !detail->is_cut_out()) continue;
    const SurfacePlace place{.triangle = RTCHitN_primID(args->hit, args->N, i),
                             .u = RTCHitN_u(args->hit, args->N, i),
                             .v = RTCHitN_v(args->hit, args->N, i)};
    const std::uint32_t bits = murmur3::finished(
        murmur3::added(murmur3::added(RTCRayN_id(args->ray, args->N, i), index), place.triangle));
    const float draw = static_cast<float>((bits >> 8) + 1) * 0x1p-24f;
    if (is_cut_away(scene, instance, place, draw)) args->valid[i] = 0;
  }
}

}  // namespace baton
