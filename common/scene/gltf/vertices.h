#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/gltf/document.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton::gltf {

/// What lies in the accessors of a primitive.
struct Vertices {
  std::vector<float> positions, normals;  ///< (vertices, 3); normals may be empty
  std::vector<float> tangents;            ///< (vertices, 4), or empty
  std::array<std::vector<float>, 2> uvs;  ///< (vertices, 2), or empty
  std::vector<VertexColor> colors;        ///< (vertices), or empty
  std::vector<std::uint32_t> corners;     ///< (triangles, 3)
  MeshRepairs repairs{};

  std::size_t count() const { return positions.size() / 3; }
  int num_uv_sets() const { return uvs[0].empty() ? 0 : uvs[1].empty() ? 1 : 2; }
};

/// Reads a primitive with a surface. Of normals and tangents those that are no directions are made
/// anew: from the triangles around, from the coordinates of the normal map. Vertices whose place is
/// not finite have no triangles, those whose texture coordinates are not have (0, 0). place: of the
/// primitive in the file's JSON, which errors name: accessors that do not fit, indices out of
/// range.
Result<Vertices> read_vertices(const Document& document, const Primitive& primitive,
                               const std::string& place);
/// Values of an accessor that must have one element of `width` numbers for each of `count`
/// vertices; they need not be finite. name: of the attribute.
Result<std::vector<float>> read_attribute(const Document& document, int accessor, int width,
                                          std::size_t count, const std::string& place,
                                          const std::string& name);

/// Whether a primitive makes triangles; reads no more than it must. deforms: those with area in
/// some frame count. What cannot be read is a fault of read_vertices.
bool has_triangles(const Document& document, const Primitive& primitive, bool deforms);
/// Whether the file gives the primitive a normal map: other tangents would only part its vertices.
bool is_bumpy(const Document& document, const Primitive& primitive);
/// Whether it has triangles.
bool has_surface(const Primitive& primitive);
/// What the file has without a surface, such as "2 parts of points and 1 of lines"; empty: nothing.
std::string surfaceless_parts(const Document& document);
std::string place_of(int mesh, std::size_t primitive);

inline Vec3 vec3_at(const std::vector<float>& values, std::size_t i) {
  return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}
Tangent tangent_at(const Vertices& v, std::size_t vertex);

}  // namespace baton::gltf
