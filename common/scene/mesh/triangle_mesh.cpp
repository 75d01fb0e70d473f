#include "common/scene/mesh/triangle_mesh.h"

#include "common/scene/mesh/tangents.h"

namespace baton {

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
