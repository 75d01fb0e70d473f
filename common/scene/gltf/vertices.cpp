#include "common/scene/gltf/vertices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <span>

#include "common/scene/gltf/accessor.h"
#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/mesh/tangents.h"

namespace baton::gltf {
namespace {

constexpr int kPoints = 0, kTriangles = 4, kStrip = 5, kFan = 6;

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

/// COLOR_0, whose alpha may be missing.
Status read_colors(const Document& document, const Primitive& primitive, const std::string& place,
                   Vertices& v) {
  if (primitive.colors < 0) return {};
  const bool is_opaque = document.accessors[static_cast<std::size_t>(primitive.colors)].width == 3;
  const std::size_t width = is_opaque ? 3 : 4;
  BATON_ASSIGN(const std::vector<float> values,
               read_attribute(document, primitive.colors, static_cast<int>(width), v.count(), place,
                              "COLOR_0"));
  v.colors.assign(v.count(), {1, 1, 1, 1});
  for (std::size_t i = 0; i < v.count(); ++i) {
    bool is_sound = true;
    for (std::size_t c = 0; c < width; ++c)
      v.colors[i][c] = color_channel(values[i * width + c], is_sound);
    v.repairs.colors += is_sound ? 0 : 1;
  }
  return {};
}

using Corners = std::array<std::uint32_t, 3>;

/// The triangles of a primitive with area.
std::vector<Corners> whole_triangles(const Vertices& v, std::span<const Vec3> positions) {
  std::vector<Corners> triangles;
  for (std::size_t i = 0; i < v.corners.size(); i += 3) {
    const Corners t{v.corners[i], v.corners[i + 1], v.corners[i + 2]};
    if (has_area(positions[t[0]], positions[t[1]], positions[t[2]])) triangles.push_back(t);
  }
  return triangles;
}

std::vector<Vec3> vectors_of(const std::vector<float>& numbers) {
  std::vector<Vec3> vectors;
  for (std::size_t i = 0; i < numbers.size() / 3; ++i) vectors.push_back(vec3_at(numbers, i));
  return vectors;
}

/// Whether tangent i lies across its normal; of a normal that is no direction nothing is asked.
bool is_tangent(const Vertices& v, std::size_t i) {
  constexpr float kLeastSine = 1e-3f;
  const float* const t = v.tangents.data() + 4 * i;
  const Vec3 tangent{t[0], t[1], t[2]};
  if (!is_direction(tangent) || !std::isfinite(t[3])) return false;
  const Vec3 normal = v.normals.empty() ? Vec3{} : vec3_at(v.normals, i);
  return !is_direction(normal) || length(cross(normalize(tangent), normalize(normal))) > kLeastSine;
}

/// Tangents of the coordinates that the normal map lies by; those that face no way where there are
/// none.
std::vector<Tangent> made_tangents(const Document& document, const Primitive& primitive,
                                   const Vertices& v, std::span<const Vec3> positions,
                                   std::span<const Corners> triangles) {
  const std::vector<Vec3> normals = vectors_of(v.normals);
  const int set =
      is_bumpy(document, primitive)
          ? document.materials[static_cast<std::size_t>(primitive.material)].normal_texture.uv
          : 0;
  const std::vector<float>& given = v.uvs[static_cast<std::size_t>(set)];
  std::vector<Uv> uvs(v.count());
  for (std::size_t i = 0; i < given.size() / 2; ++i) uvs[i] = {given[2 * i], given[2 * i + 1]};
  return tangents_of(positions, normals, triangles, uvs);
}

/// Leaves out triangles with a corner whose place is not finite. Such a vertex gets the place of
/// another, so that those that stay listed are finite.
void drop_nowhere(Vertices& v) {
  std::vector<std::size_t> nowhere;
  std::size_t sound = 0;
  for (std::size_t i = v.count(); i-- > 0;)
    is_finite(v.positions, 3, i) ? void(sound = i) : nowhere.push_back(i);
  if (nowhere.empty()) return;
  std::vector<bool> is_nowhere(v.count(), false);
  for (const std::size_t i : nowhere) is_nowhere[i] = true;
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < v.corners.size(); i += 3) {
    const std::span<const std::uint32_t> triangle = std::span(v.corners).subspan(i, 3);
    if (std::ranges::any_of(triangle, [&](std::uint32_t vertex) { return is_nowhere[vertex]; })) {
      ++v.repairs.nowhere;
    } else {
      kept.insert(kept.end(), triangle.begin(), triangle.end());
    }
  }
  v.corners = std::move(kept);
  const Vec3 place = is_nowhere[sound] ? Vec3{} : vec3_at(v.positions, sound);
  for (const std::size_t i : nowhere)
    std::ranges::copy(std::array{place.x, place.y, place.z},
                      v.positions.begin() + static_cast<std::ptrdiff_t>(3 * i));
}

/// Texture coordinates that are not finite become (0, 0); counts those that triangles use.
void mend_coordinates(Vertices& v) {
  std::set<std::size_t> mended;
  for (std::vector<float>& uvs : v.uvs) {
    for (std::size_t i = 0; i < uvs.size() / 2; ++i) {
      if (is_finite(uvs, 2, i)) continue;
      uvs[2 * i] = uvs[2 * i + 1] = 0;
      mended.insert(i);
    }
  }
  if (mended.empty()) return;
  for (const std::uint32_t vertex : std::set(v.corners.begin(), v.corners.end()))
    v.repairs.uvs += mended.contains(vertex) ? 1 : 0;
}

/// Makes normals and tangents anew that are no directions; counts those that triangles use.
void mend_vertices(const Document& document, const Primitive& primitive, Vertices& v) {
  std::vector<std::size_t> normals, tangents;
  for (std::size_t i = 0; i < v.normals.size() / 3; ++i)
    if (!is_direction(vec3_at(v.normals, i))) normals.push_back(i);
  for (std::size_t i = 0; i < v.tangents.size() / 4; ++i)
    if (!is_tangent(v, i)) tangents.push_back(i);
  if (normals.empty() && tangents.empty()) return;

  const std::vector<Vec3> positions = vectors_of(v.positions);
  const std::vector<Corners> triangles = whole_triangles(v, positions);
  std::vector<bool> is_used(v.count(), false);
  for (const Corners& t : triangles)
    for (const std::uint32_t vertex : t) is_used[vertex] = true;
  const auto count = [&](const std::vector<std::size_t>& vertices) {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(vertices, [&](std::size_t i) { return is_used[i]; }));
  };
  v.repairs.normals = count(normals);
  v.repairs.tangents = count(tangents);
  if (!normals.empty()) {
    const std::vector<Vec3> made = smooth_vertex_normals(positions, triangles);
    for (const std::size_t i : normals) {
      const Vec3 n = normalize(made[i]);
      std::ranges::copy(std::array{n.x, n.y, n.z}, v.normals.begin() + static_cast<long>(3 * i));
    }
  }
  if (tangents.empty() || v.normals.empty()) return;
  const std::vector<Tangent> made = made_tangents(document, primitive, v, positions, triangles);
  for (const std::size_t i : tangents) {
    const Vec3& t = made[i].direction;
    std::ranges::copy(std::array{t.x, t.y, t.z, made[i].side},
                      v.tangents.begin() + static_cast<long>(4 * i));
  }
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
    BATON_ASSIGN(values, read_attribute(document, accessor, width, count, place, name));
    return {};
  };
  BATON_TRY(attribute(primitive.normals, 3, "NORMAL", v.normals));
  BATON_TRY(attribute(primitive.tangents, 4, "TANGENT", v.tangents));
  BATON_TRY(attribute(primitive.uvs[0], 2, "TEXCOORD_0", v.uvs[0]));
  BATON_TRY(attribute(primitive.uvs[1], 2, "TEXCOORD_1", v.uvs[1]));
  BATON_TRY(read_colors(document, primitive, place, v));

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
  v.repairs.spare_indices = primitive.mode == kTriangles ? indices.size() % 3 : 0;
  drop_nowhere(v);
  mend_coordinates(v);
  mend_vertices(document, primitive, v);
  return v;
}

Result<std::vector<float>> read_attribute(const Document& document, int accessor, int width,
                                          std::size_t count, const std::string& place,
                                          const std::string& name) {
  BATON_ASSIGN(std::vector<float> values, read_floats(document, accessor, width));
  if (values.size() == count * static_cast<std::size_t>(width)) return values;
  return document.error(fmt::format("{}.{}: expected one for each of {} vertices, got {}", place,
                                    name, count, values.size() / static_cast<std::size_t>(width)));
}

bool has_triangles(const Document& document, const Primitive& primitive, bool deforms) {
  Primitive shape = primitive;
  shape.normals = shape.tangents = shape.colors = -1;
  shape.uvs = {-1, -1};
  const Result<Vertices> v = read_vertices(document, shape, "");
  if (!v) return true;
  for (std::size_t i = 0; i < v->corners.size(); i += 3) {
    const std::uint32_t a = v->corners[i], b = v->corners[i + 1], c = v->corners[i + 2];
    const bool is_one = deforms ? a != b && b != c && c != a
                                : has_area(vec3_at(v->positions, a), vec3_at(v->positions, b),
                                           vec3_at(v->positions, c));
    if (is_one) return true;
  }
  return false;
}

Tangent tangent_at(const Vertices& v, std::size_t vertex) {
  const float* const t = v.tangents.data() + 4 * vertex;
  return {normalize({t[0], t[1], t[2]}), t[3] < 0 ? -1.0f : 1.0f};
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

std::string surfaceless_parts(const Document& document) {
  std::size_t points = 0, lines = 0, unknown = 0;
  for (const Mesh& mesh : document.meshes) {
    for (const Primitive& primitive : mesh.primitives) {
      if (has_surface(primitive)) continue;
      ++(primitive.mode == kPoints ? points : primitive.mode < kTriangles ? lines : unknown);
    }
  }
  std::vector<std::string> found;
  for (const auto& [count, what] :
       {std::pair{points, "points"}, {lines, "lines"}, {unknown, "an unknown form"}}) {
    if (count == 0) continue;
    found.push_back(found.empty()
                        ? fmt::format("{} part{} of {}", count, count > 1 ? "s" : "", what)
                        : fmt::format("{} of {}", count, what));
  }
  return fmt::format("{}", fmt::join(found, " and "));
}

}  // namespace baton::gltf
