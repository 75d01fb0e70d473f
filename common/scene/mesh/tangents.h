#pragma once

#include <span>
#include <vector>

#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// Gives the mesh tangents from its texture coordinates of set `uv_set`, which it has, where it has
/// none: at each vertex the mean over the triangles around it, weighted by their corners' angles,
/// as MikkTSpace does. Where images that are mirrored to each other meet, vertices become two.
void derive_tangents(TriangleMesh& mesh, std::size_t uv_set);

/// Tangents of vertices by their coordinates `uvs`, none of which becomes two.
/// normals: of the vertices, or none.
std::vector<Tangent> tangents_of(std::span<const Vec3> positions, std::span<const Vec3> normals,
                                 std::span<const std::array<std::uint32_t, 3>> triangles,
                                 std::span<const Uv> uvs);

/// The tangents of a mesh that had them derived, in another shape, which has none yet.
std::vector<Tangent> tangents_of(const TriangleMesh& mesh, const MeshShape& shape);

}  // namespace baton
