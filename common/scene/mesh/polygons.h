#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// The faces of a file as it has them.
struct Polygons {
  /// No normal, no texture coordinates.
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::vector<Position> positions;  ///< need not be finite
  std::vector<Vec3> normals;        ///< need not be unit; no direction: none
  std::vector<Uv> uvs;              ///< need not be finite
  std::vector<VertexColor> colors;  ///< by position, or empty
  /// Places in the lists above, face after face. Where one of the last two is empty, its list is
  /// by position, if it has as many, or there is none.
  std::vector<std::uint32_t> corners, corner_normals, corner_uvs;
  std::vector<std::uint32_t> sizes;  ///< corners of each face
  std::uint64_t lines = 0;           ///< points and lines, which have no surface
  /// As MeshRepairs counts them.
  std::uint64_t bad_colors = 0, unread_colors = 0, formulas = 0, unread_lines = 0;

  std::size_t num_faces() const { return sizes.size(); }
};

/// Cuts a face into triangles; indices into `corners`. Faces that turn one way around their first
/// corner are fans, bent quadrilaterals are cut along their shorter diagonal, others are cut ear by
/// ear, seen along their normal [Meisters 1975], whichever corner comes first. is_simple: false
/// where its edges cross, so that some of it is a fan; not changed otherwise.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Position> corners,
                                                      bool& is_simple);

/// A mesh of the faces with finite corners, the others being counted. with_normals, with_uvs: those
/// of the file; what a corner lacks of them is made anew, counted. Positions far from the origin
/// are relative to one of their own.
TriangleMesh mesh_of(const Polygons& polygons, bool with_normals, bool with_uvs);

}  // namespace baton
