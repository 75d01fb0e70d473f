#include "common/scene/mesh/triangle_mesh.h"

#include <algorithm>
#include <cmath>

#include "common/scene/mesh/tangents.h"

namespace baton {

float color_channel(double value, bool& is_sound) {
  constexpr double kRounding = 1e-3;
  is_sound = is_sound && value >= -kRounding && value <= 1 + kRounding;
  if (std::isnan(value)) return 1;
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
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
