#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// What vertices have beside their position.
struct MeshParts {
  bool normals = false;
  int uv_sets = 0;  ///< [0, 2]
  bool tangents = false;
  bool colors = false;
};

/// Collects the triangles of all parts of a file into one mesh: equal vertices become one,
/// triangles without area are dropped and counted.
class MeshBuilder {
 public:
  /// Corners that differ in one of `parts` stay different vertices.
  explicit MeshBuilder(MeshParts parts) : parts_(parts) {}

  /// The triangles that follow are of a list of so many vertices, another one than before.
  void begin_part(std::size_t num_vertices);
  /// Adds a triangle of finite corners. vertices: their places in the part's list; a place always
  /// has the same position, normal and so on. normals: unit, or 0 where there is none. What `parts`
  /// does not name is not looked at.
  void add(const std::array<std::uint32_t, 3>& vertices, const std::array<Vec3, 3>& corners,
           const std::array<Vec3, 3>& normals = {}, const std::array<UvSets, 3>& uvs = {},
           const std::array<Tangent, 3>& tangents = {},
           const std::array<VertexColor, 3>& colors = {});
  /// The mesh; vertices without a normal take that of the faces around, and are counted.
  TriangleMesh take();

 private:
  struct Vertex {
    Vec3 position, normal;
    UvSets uvs{};
    Tangent tangent{};
    VertexColor color{};
  };
  /// Bits of position, normal, UVs, tangent and colour.
  using VertexKey = std::array<std::uint32_t, 18>;
  VertexKey key_of(const Vertex& v) const;
  VertexKey key_of(std::uint32_t vertex) const;
  std::uint32_t vertex(const Vertex& v);
  std::size_t find_slot(const VertexKey& key) const;

  MeshParts parts_;
  TriangleMesh mesh_;
  /// Hash table of open addressing: numbers of vertices + 1, 0 where there is none. Its size is a
  /// power of two, at least twice the vertices.
  std::vector<std::uint32_t> slots_;
  /// By place in the part's list, likewise: each vertex is looked for once.
  std::vector<std::uint32_t> of_part_;
};

/// Whether a triangle has a normal in float.
bool has_area(const Vec3& a, const Vec3& b, const Vec3& c);

/// A vector that normals can be made of: finite, with a length.
bool is_direction(const Vec3& v);

/// Angle-weighted unit vertex normals [Thuermer & Wuethrich 1998]. Where faces cancel each other (a
/// sheet with two sides) the vertex takes the normal of one of them; where there is none, 0.
std::vector<Vec3> smooth_vertex_normals(std::span<const Vec3> positions,
                                        std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace baton
