#include "common/scene/mesh/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/scene/mesh/tangents.h"

namespace baton {

float color_channel(double value, bool& is_sound) {
  constexpr double kRounding = 1e-3;
  is_sound = is_sound && value >= -kRounding && value <= 1 + kRounding;
  if (std::isnan(value)) return 1;
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

std::span<const RepairKind> repair_kinds() {
  static constexpr RepairKind kKinds[] = {
      {&MeshRepairs::nowhere, "faces have a corner whose place is not finite: they are not shown"},
      {&MeshRepairs::instances,
       "repetitions of a mesh have a place that is not finite: they are not shown"},
      {&MeshRepairs::normals, "vertices have no usable normal: they take that of the faces around"},
      {&MeshRepairs::tangents,
       "vertices have no usable tangent: they take that of the coordinates"},
      {&MeshRepairs::weights, "vertices are held by no joint: they follow the first one"},
      {&MeshRepairs::holds,
       "weights of joints are below 0 or not finite, or their joint's matrix is: they count as 0"},
      {&MeshRepairs::steps, "steps of morph targets are not finite: they count as 0"},
      {&MeshRepairs::uvs, "corners have no usable texture coordinates: they have (0, 0)"},
      {&MeshRepairs::crossing, "faces have edges that cross, or too many: they are cut as fans"},
      {&MeshRepairs::lines, "points, lines or faces of two corners are not shown"},
      {&MeshRepairs::colors,
       "vertices have colours that are not from 0 to 1: they are cut, or white"},
      {&MeshRepairs::unread_colors,
       "vertices or faces have colours in a form that is not read: they count as white"},
      {&MeshRepairs::formulas, "curves or surfaces of formulas are not shown"},
      {&MeshRepairs::unread_lines,
       "lines begin with a word that is not known, or call another file: they are left out"},
      {&MeshRepairs::spare_indices, "indices at the end of lists of triangles make none"},
      {&MeshRepairs::shrunk, "parts are shrunk to nothing by their bones or morph weights"},
  };
  static_assert(sizeof(MeshRepairs) == std::size(kKinds) * sizeof(std::uint64_t));
  return kKinds;
}

MeshRepairs& MeshRepairs::operator+=(const MeshRepairs& other) {
  for (const RepairKind& kind : repair_kinds()) this->*kind.count += other.*kind.count;
  return *this;
}

MeshShape TriangleMesh::shape_at(double frame) const {
  MeshShape shape = deformation->at(frame);
  for (const std::uint32_t vertex : copied_vertices) {
    shape.positions.push_back(shape.positions[vertex]);
    if (!shape.normals.empty()) shape.normals.push_back(shape.normals[vertex]);
  }
  if (tangent_uv_set >= 0) shape.tangents = tangents_of(*this, shape);
  return shape;
}

}  // namespace baton
