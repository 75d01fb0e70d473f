#include "common/scene/mesh/mesh_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace baton {
namespace {

/// Triangles whose doubled area is below this share of their longest edge squared have no normal in
/// float.
constexpr double kMinRelativeArea = 1e-7;

/// Sums of angle-weighted normals shorter than this are rounding.
constexpr float kCancelled = 1e-3f;

double squared_length(const Vec3& v) {
  return double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z;
}

double doubled_area(const Vec3& a, const Vec3& b) {
  const double x = double{a.y} * b.z - double{a.z} * b.y;
  const double y = double{a.z} * b.x - double{a.x} * b.z;
  const double z = double{a.x} * b.y - double{a.y} * b.x;
  return std::sqrt(x * x + y * y + z * z);
}

/// Adding 0 makes -0 and 0 one.
std::uint32_t bits(float f) { return std::bit_cast<std::uint32_t>(f + 0.0f); }

}  // namespace

bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 to_b = b - a, to_c = c - a;
  const double longest =
      std::max({squared_length(to_b), squared_length(to_c), squared_length(c - b)});
  return doubled_area(to_b, to_c) > kMinRelativeArea * longest;
}

void MeshBuilder::add(const std::array<std::uint32_t, 3>& vertices,
                      const std::array<Vec3, 3>& corners, const std::array<Vec3, 3>& normals,
                      const std::array<UvSets, 3>& uvs, const std::array<Tangent, 3>& tangents,
                      const std::array<VertexColor, 3>& colors) {
  if (!has_area(corners[0], corners[1], corners[2])) {
    ++mesh_.dropped_triangles;
    return;
  }
  std::array<std::uint32_t, 3> triangle{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::uint32_t& known = of_part_[vertices[k]];
    if (known == 0)
      known = vertex({corners[k], parts_.normals ? normals[k] : Vec3{}, uvs[k], tangents[k],
                      colors[k]}) +
              1;
    triangle[k] = known - 1;
  }
  mesh_.triangles.push_back(triangle);
}

MeshBuilder::VertexKey MeshBuilder::key_of(const Vertex& v) const {
  VertexKey key{bits(v.position.x), bits(v.position.y), bits(v.position.z)};
  if (parts_.normals) {
    key[3] = bits(v.normal.x);
    key[4] = bits(v.normal.y);
    key[5] = bits(v.normal.z);
  }
  for (std::size_t i = 0; i < 2 * static_cast<std::size_t>(parts_.uv_sets); ++i)
    key[6 + i] = bits(v.uvs[i / 2][i % 2]);
  if (parts_.tangents) {
    const Vec3& t = v.tangent.direction;
    key[10] = bits(t.x);
    key[11] = bits(t.y);
    key[12] = bits(t.z);
    key[13] = bits(v.tangent.side);
  }
  for (std::size_t i = 0; parts_.colors && i < 4; ++i) key[14 + i] = bits(v.color[i]);
  return key;
}

MeshBuilder::VertexKey MeshBuilder::key_of(std::uint32_t vertex) const {
  Vertex v{mesh_.positions[vertex], parts_.normals ? mesh_.normals[vertex] : Vec3{}};
  for (std::size_t set = 0; set < static_cast<std::size_t>(parts_.uv_sets); ++set)
    v.uvs[set] = mesh_.uvs[set][vertex];
  if (parts_.tangents) v.tangent = mesh_.tangents[vertex];
  if (parts_.colors) v.color = mesh_.colors[vertex];
  return key_of(v);
}

/// Where the vertex is, or would be put.
std::size_t MeshBuilder::find_slot(const VertexKey& key) const {
  const bool is_plain = parts_.uv_sets == 0 && !parts_.tangents && !parts_.colors;
  const std::size_t count = !is_plain ? key.size() : parts_.normals ? 6 : 3;
  std::uint64_t hash = 0;
  for (const std::uint32_t word : std::span(key).first(count)) {
    hash = (hash ^ word) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  }
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash & mask;
  while (slots_[slot] != 0 && key_of(slots_[slot] - 1) != key) slot = (slot + 1) & mask;
  return slot;
}

void MeshBuilder::begin_part(std::size_t num_vertices) {
  of_part_.assign(num_vertices, 0);
  const std::size_t most = mesh_.positions.size() + num_vertices;
  if (slots_.size() >= 2 * most) return;
  slots_.assign(std::bit_ceil(2 * most), 0);
  for (std::uint32_t v = 0; v < mesh_.positions.size(); ++v) slots_[find_slot(key_of(v))] = v + 1;
}

std::uint32_t MeshBuilder::vertex(const Vertex& v) {
  const auto sets = static_cast<std::size_t>(parts_.uv_sets);
  const std::size_t slot = find_slot(key_of(v));
  if (slots_[slot] == 0) {
    mesh_.positions.push_back(v.position);
    if (parts_.normals) mesh_.normals.push_back(v.normal);
    for (std::size_t set = 0; set < sets; ++set) mesh_.uvs[set].push_back(v.uvs[set]);
    if (parts_.tangents) mesh_.tangents.push_back(v.tangent);
    if (parts_.colors) mesh_.colors.push_back(v.color);
    slots_[slot] = static_cast<std::uint32_t>(mesh_.positions.size());
  }
  return slots_[slot] - 1;
}

TriangleMesh MeshBuilder::take() {
  const auto is_missing = [](const Vec3& normal) { return normal == Vec3{}; };
  mesh_.repairs.normals =
      static_cast<std::uint64_t>(std::ranges::count_if(mesh_.normals, is_missing));
  if (mesh_.repairs.normals > 0) {
    const std::vector<Vec3> made = smooth_vertex_normals(mesh_.positions, mesh_.triangles);
    for (std::size_t i = 0; i < made.size(); ++i) {
      if (is_missing(mesh_.normals[i])) mesh_.normals[i] = made[i];
    }
  }
  return std::move(mesh_);
}

bool is_direction(const Vec3& v) {
  const float norm = length(v);
  return norm > 0 && std::isfinite(norm);
}

std::vector<Vec3> smooth_vertex_normals(std::span<const Vec3> positions,
                                        std::span<const std::array<std::uint32_t, 3>> triangles) {
  // Sum the face normals at each vertex, weighted by the corner's angle.
  std::vector<Vec3> sum(positions.size());
  std::vector<Vec3> of_one_face(positions.size());
  for (const auto& [a, b, c] : triangles) {
    const Vec3 &at_a = positions[a], &at_b = positions[b], &at_c = positions[c];
    if (!has_area(at_a, at_b, at_c)) continue;
    // There and back: exactly as if each were normalized.
    const Vec3 a_to_b = normalize(at_b - at_a), b_to_a = Vec3{} - a_to_b;
    const Vec3 b_to_c = normalize(at_c - at_b), c_to_b = Vec3{} - b_to_c;
    const Vec3 c_to_a = normalize(at_a - at_c), a_to_c = Vec3{} - c_to_a;
    const Vec3 normal = normalize(cross(a_to_b, a_to_c));
    const auto add = [&](std::uint32_t vertex, const Vec3& to_next, const Vec3& to_last) {
      sum[vertex] += normal * std::atan2(length(cross(to_next, to_last)), dot(to_next, to_last));
      of_one_face[vertex] = normal;
    };
    add(a, a_to_b, a_to_c);
    add(b, b_to_c, b_to_a);
    add(c, c_to_a, c_to_b);
  }

  // Normalise what did not cancel.
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = length(sum[i]) > kCancelled ? normalize(sum[i]) : of_one_face[i];
  }
  return sum;
}

}  // namespace baton
