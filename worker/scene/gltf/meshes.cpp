#include "worker/scene/gltf/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/math/inverse.h"
#include "worker/scene/gltf/accessor.h"
#include "worker/scene/gltf/node_motion.h"
#include "worker/scene/mesh_builder.h"

namespace baton::gltf {
namespace {

constexpr int kTriangles = 4, kStrip = 5, kFan = 6;

/// What lies in the accessors of a primitive.
struct Vertices {
  std::vector<float> positions, normals;  ///< (vertices, 3); normals may be empty
  std::vector<float> tangents;            ///< (vertices, 4), or empty
  std::array<std::vector<float>, 2> uvs;  ///< (vertices, 2), or empty
  std::vector<std::uint32_t> corners;     ///< (triangles, 3)
};

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

Vec3 vec3_at(const std::vector<float>& values, std::size_t i) {
  return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

/// Corners of triangles from a list, a strip or a fan; of other modes nothing.
std::vector<std::uint32_t> triangles_of(const std::vector<std::uint32_t>& indices, int mode) {
  std::vector<std::uint32_t> corners;
  if (mode == kTriangles) {
    corners.assign(indices.begin(),
                   indices.end() - static_cast<std::ptrdiff_t>(indices.size() % 3));
  }
  for (std::size_t i = 0; mode != kTriangles && mode >= kStrip && i + 2 < indices.size(); ++i) {
    if (mode == kFan) corners.insert(corners.end(), {indices[0], indices[i + 1], indices[i + 2]});
    if (mode == kStrip)
      corners.insert(corners.end(), {indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]});
  }
  return corners;
}

/// Reads a primitive with a surface. place: of the primitive in the file's JSON.
Result<Vertices> read_vertices(const Document& document, const Primitive& primitive,
                               const std::string& place) {
  Vertices v;
  if (primitive.positions < 0) return document.error(place + ": expected POSITION");
  BATON_ASSIGN(v.positions, read_floats(document, primitive.positions, 3));
  const std::size_t count = v.positions.size() / 3;
  const auto attribute = [&](int accessor, int width, const char* name,
                             std::vector<float>& values) -> Status {
    if (accessor < 0) return {};
    BATON_ASSIGN(values, read_floats(document, accessor, width));
    if (values.size() == count * static_cast<std::size_t>(width)) return {};
    return document.error(fmt::format("{}.{}: expected one for each of {} vertices, got {}", place,
                                      name, count,
                                      values.size() / static_cast<std::size_t>(width)));
  };
  BATON_TRY(attribute(primitive.normals, 3, "NORMAL", v.normals));
  BATON_TRY(attribute(primitive.tangents, 4, "TANGENT", v.tangents));
  BATON_TRY(attribute(primitive.uvs[0], 2, "TEXCOORD_0", v.uvs[0]));
  BATON_TRY(attribute(primitive.uvs[1], 2, "TEXCOORD_1", v.uvs[1]));
  if (!all_finite(v.positions))
    return document.error(place + ": a vertex has a coordinate that is not finite");
  if (!all_finite(v.uvs[0]) || !all_finite(v.uvs[1]))
    return document.error(place + ": a vertex has texture coordinates that are not finite");

  std::vector<std::uint32_t> indices(primitive.indices < 0 ? count : 0);
  std::iota(indices.begin(), indices.end(), 0u);
  if (primitive.indices >= 0) {
    BATON_ASSIGN(indices, read_indices(document, primitive.indices));
  }
  for (const std::uint32_t index : indices) {
    if (index >= count)
      return document.error(
          fmt::format("{}: expected a vertex index below {}, found {}", place, count, index));
  }
  v.corners = triangles_of(indices, primitive.mode);
  return v;
}

/// Normals that are no directions are as good as none.
bool has_usable_normals(const Vertices& v) {
  if (v.normals.empty() || !all_finite(v.normals)) return false;
  for (std::size_t i = 0; i < v.normals.size() / 3; ++i) {
    if (!(length(vec3_at(v.normals, i)) > 0)) return false;
  }
  return true;
}

Tangent tangent_at(const Vertices& v, std::size_t vertex) {
  const float* const t = v.tangents.data() + 4 * vertex;
  return {normalize({t[0], t[1], t[2]}), t[3] < 0 ? -1.0f : 1.0f};
}

/// Tangents count where normals do, as they lie at a right angle to them.
bool has_usable_tangents(const Vertices& v) {
  if (v.tangents.empty() || !has_usable_normals(v) || !all_finite(v.tangents)) return false;
  for (std::size_t i = 0; i < v.tangents.size(); i += 4) {
    if (!(length({v.tangents[i], v.tangents[i + 1], v.tangents[i + 2]}) > 0)) return false;
  }
  return true;
}

void add_triangles(const Vertices& v, const Matrix& to_file, const MeshParts& parts,
                   MeshBuilder& builder) {
  const Transform transform = to_transform(to_file);
  const Mat3 normal_to_file = inverse_transposed(transform.linear).value_or(Mat3{});
  const bool mirrored = determinant(to_file) < 0;
  for (std::size_t i = 0; i < v.corners.size(); i += 3) {
    std::array<Vec3, 3> corners, normals;
    std::array<UvSets, 3> uvs{};
    std::array<Tangent, 3> tangents{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t vertex = v.corners[i + (mirrored ? 2 - k : k)];
      corners[k] = transform.point(vec3_at(v.positions, vertex));
      if (parts.normals) normals[k] = normalize(normal_to_file * vec3_at(v.normals, vertex));
      for (std::size_t set = 0; set < static_cast<std::size_t>(parts.uv_sets); ++set)
        uvs[k][set] = {v.uvs[set][2 * vertex], v.uvs[set][2 * vertex + 1]};
      if (parts.tangents) tangents[k] = tangent_at(v, vertex);
    }
    builder.add(corners, normals, uvs, tangents);
  }
}

/// Whether the file gives the primitive a normal map: other tangents would only part its vertices.
bool is_bumpy(const Document& document, const Primitive& primitive) {
  return primitive.material >= 0 &&
         document.materials[static_cast<std::size_t>(primitive.material)].normal_texture.texture >=
             0;
}

int uv_sets_of(const Vertices& v) {
  if (v.uvs[0].empty()) return 0;
  return v.uvs[1].empty() ? 1 : 2;
}

std::string place_of(int mesh, std::size_t primitive) {
  return fmt::format("$.meshes[{}].primitives[{}]", mesh, primitive);
}

bool has_surface(const Primitive& primitive) {
  return primitive.mode >= kTriangles && primitive.mode <= kFan;
}

}  // namespace

Result<TriangleMesh> primitive_mesh(const Document& document, int mesh, int primitive,
                                    bool smooth_normals) {
  const std::string place = place_of(mesh, static_cast<std::size_t>(primitive));
  const auto m = static_cast<std::size_t>(mesh), p = static_cast<std::size_t>(primitive);
  if (mesh < 0 || m >= document.meshes.size() || primitive < 0 ||
      p >= document.meshes[m].primitives.size())
    return document.error(place + ": not there");
  BATON_ASSIGN(const Vertices v, read_vertices(document, document.meshes[m].primitives[p], place));
  const bool with_normals = smooth_normals && has_usable_normals(v);
  const bool with_tangents = with_normals && is_bumpy(document, document.meshes[m].primitives[p]) &&
                             has_usable_tangents(v);
  const MeshParts parts{with_normals, uv_sets_of(v), with_tangents};
  MeshBuilder builder(parts);
  add_triangles(v, kIdentity, parts, builder);
  TriangleMesh result = builder.take();
  if (result.triangles.empty())
    return document.error(
        fmt::format("{}: no triangles ({} without area)", place, result.dropped_triangles));
  return result;
}

Result<TriangleMesh> whole_mesh(const Document& document, bool smooth_normals) {
  struct Part {
    Vertices vertices;
    Matrix to_file;
  };
  const std::vector<Matrix> to_world = NodeMotion::at_rest(document);
  std::vector<Part> parts;
  MeshParts common{.normals = smooth_normals, .uv_sets = 2};
  for (const int node : shown_nodes(document)) {
    const int mesh = document.nodes[static_cast<std::size_t>(node)].mesh;
    if (mesh < 0) continue;
    const Mesh& given = document.meshes[static_cast<std::size_t>(mesh)];
    for (std::size_t p = 0; p < given.primitives.size(); ++p) {
      if (!has_surface(given.primitives[p])) continue;
      BATON_ASSIGN(Vertices v, read_vertices(document, given.primitives[p], place_of(mesh, p)));
      common.normals = common.normals && has_usable_normals(v);
      common.uv_sets = std::min(common.uv_sets, uv_sets_of(v));
      parts.push_back({std::move(v), to_world[static_cast<std::size_t>(node)]});
    }
  }
  MeshBuilder builder(common);
  for (const Part& part : parts) add_triangles(part.vertices, part.to_file, common, builder);
  return builder.take();
}

}  // namespace baton::gltf
