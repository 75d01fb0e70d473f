#include "common/scene/gltf/vertices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/scene/gltf/accessor.h"

namespace baton::gltf {
namespace {

constexpr int kTriangles = 4, kStrip = 5, kFan = 6;

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
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

Result<std::vector<float>> read_counted(const Document& document, int accessor, int width,
                                        std::size_t count, const std::string& place,
                                        const std::string& name) {
  BATON_ASSIGN(std::vector<float> values, read_floats(document, accessor, width));
  if (values.size() == count * static_cast<std::size_t>(width)) return values;
  return document.error(fmt::format("{}.{}: expected one for each of {} vertices, got {}", place,
                                    name, count, values.size() / static_cast<std::size_t>(width)));
}

}  // namespace

Result<Vertices> read_vertices(const Document& document, const Primitive& primitive,
                               const std::string& place) {
  Vertices v;
  if (primitive.positions < 0) return document.error(place + ": expected POSITION");
  BATON_ASSIGN(v.positions, read_floats(document, primitive.positions, 3));
  const std::size_t count = v.count();
  const auto attribute = [&](int accessor, int width, const char* name,
                             std::vector<float>& values) -> Status {
    if (accessor < 0) return {};
    BATON_ASSIGN(values, read_counted(document, accessor, width, count, place, name));
    return {};
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

Result<std::vector<float>> read_attribute(const Document& document, int accessor, int width,
                                          std::size_t count, const std::string& place,
                                          const std::string& name) {
  BATON_ASSIGN(std::vector<float> values,
               read_counted(document, accessor, width, count, place, name));
  if (!all_finite(values))
    return document.error(fmt::format("{}.{}: a value is not finite", place, name));
  return values;
}

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

bool has_usable_tangents(const Vertices& v) {
  if (v.tangents.empty() || !has_usable_normals(v) || !all_finite(v.tangents)) return false;
  for (std::size_t i = 0; i < v.tangents.size(); i += 4) {
    if (!(length({v.tangents[i], v.tangents[i + 1], v.tangents[i + 2]}) > 0)) return false;
  }
  return true;
}

bool is_bumpy(const Document& document, const Primitive& primitive) {
  return primitive.material >= 0 &&
         document.materials[static_cast<std::size_t>(primitive.material)].normal_texture.texture >=
             0;
}

std::string place_of(int mesh, std::size_t primitive) {
  return fmt::format("$.meshes[{}].primitives[{}]", mesh, primitive);
}

bool has_surface(const Primitive& primitive) {
  return primitive.mode >= kTriangles && primitive.mode <= kFan;
}

}  // namespace baton::gltf
