#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "worker/accel/accel.h"

namespace baton::kernels {

/// What a few rays met, lane by lane.
struct alignas(64) MetTriangles {
  template <class T>
  using Lanes = std::array<T, kMaxRayGroup>;

  Lanes<float> direction_x, direction_y, direction_z;  ///< the rays, unit
  /// Distance along the ray, and barycentric coordinates: those of the second and third corner.
  Lanes<float> depth, u, v;
  Lanes<std::uint32_t> triangle;
  Lanes<std::uint32_t> instance;  ///< kNothing: the ray met none
  std::size_t count = 0;          ///< rays, in the first lanes

  static constexpr std::uint32_t kNothing = ~0u;
};

/// Sets the hits of the lanes that met `instance`, whose number is that of lane `first`, the first
/// of them; hits: (count) of all lanes. Positions come from the barycentric coordinates: they lie
/// on the triangle to a few float steps, however far the ray has come. Normals are turned: the
/// geometric one to the viewer, the shading normal to that. A hit depends on no other lane.
/// with_place: hits know their places on the mesh.
void see_surfaces(const MetTriangles& met, std::size_t first, const Instance& instance,
                  std::span<const std::array<std::uint32_t, 3>> triangles,
                  const MeshVertices& vertices, const Lift& lift, bool with_place,
                  std::span<SurfaceHit> hits);

}  // namespace baton::kernels
