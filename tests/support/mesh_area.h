#pragma once

#include "common/scene/mesh/triangle_mesh.h"

namespace baton::test {

/// The sum of the areas of all triangles.
inline double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles)
    area += length(cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                         mesh.positions[t[2]] - mesh.positions[t[0]])) /
            2;
  return area;
}

}  // namespace baton::test
