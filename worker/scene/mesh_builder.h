#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>

#include "worker/scene/scene.h"

namespace baton {

/// Collects the triangles of all parts of a file into one mesh: equal vertices become one,
/// triangles without area are dropped and counted.
class MeshBuilder {
 public:
  /// with_normals: corners with different normals stay different vertices.
  explicit MeshBuilder(bool with_normals) : with_normals_(with_normals) {}

  /// Adds a triangle of finite corners. normals: unit; not looked at without `with_normals`.
  void add(const std::array<Vec3, 3>& corners, const std::array<Vec3, 3>& normals = {});
  TriangleMesh take() { return std::move(mesh_); }

 private:
  using VertexKey = std::array<std::uint32_t, 6>;  ///< bits of position and normal
  struct VertexHash {
    std::size_t operator()(const VertexKey& key) const;
  };
  std::uint32_t vertex(const Vec3& position, const Vec3& normal);

  bool with_normals_;
  TriangleMesh mesh_;
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> index_;
};

/// Angle-weighted unit vertex normals [Thuermer & Wuethrich 1998]. Where faces cancel each other (a
/// sheet with two sides) the vertex takes the normal of one of them.
std::vector<Vec3> smooth_vertex_normals(const TriangleMesh& mesh);

}  // namespace baton
