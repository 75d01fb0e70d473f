#include "common/scene/mesh/tangents.h"

#include <cmath>

namespace baton {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// How the image lies on one triangle.
struct Lie {
  /// Unit direction in which u grows; 0 where the triangle has no extent in the image.
  Vec3 along;
  /// The image is seen from where its corners go round against the clock.
  bool mirrored;
};

Lie lie_of(std::span<const Vec3> positions, std::span<const Uv> uvs, const Corners& t) {
  const Vec3 b = positions[t[1]] - positions[t[0]];
  const Vec3 c = positions[t[2]] - positions[t[0]];
  const float ub = uvs[t[1]][0] - uvs[t[0]][0], uc = uvs[t[2]][0] - uvs[t[0]][0];
  const float vb = uvs[t[1]][1] - uvs[t[0]][1], vc = uvs[t[2]][1] - uvs[t[0]][1];
  // dP/du up to a positive factor; v grows downward in the image.
  const float determinant = ub * vc - uc * vb;
  if (determinant == 0 || !std::isfinite(determinant)) return {{}, false};
  const Vec3 along = (b * vc - c * vb) * (determinant > 0 ? 1.0f : -1.0f);
  if (!(length(along) > 0)) return {{}, false};
  return {normalize(along), determinant > 0};
}

float angle_at(std::span<const Vec3> positions, const Corners& t, std::size_t k) {
  const Vec3 a = normalize(positions[t[(k + 1) % 3]] - positions[t[k]]);
  const Vec3 b = normalize(positions[t[(k + 2) % 3]] - positions[t[k]]);
  return std::atan2(length(cross(a, b)), dot(a, b));
}

/// Gives the vertices of mirrored triangles that others use, too, a copy of their own.
void part_mirrored(TriangleMesh& mesh, std::size_t uv_set) {
  std::vector<bool> is_upright(mesh.positions.size(), false);
  std::vector<bool> mirrored;
  for (const Corners& t : mesh.triangles) {
    mirrored.push_back(lie_of(mesh.positions, mesh.uvs[uv_set], t).mirrored);
    for (const std::uint32_t vertex : t)
      is_upright[vertex] = is_upright[vertex] || !mirrored.back();
  }
  std::vector<std::uint32_t> copy(mesh.positions.size(), 0);  // 0: none yet
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::uint32_t& vertex : mesh.triangles[i]) {
      if (!mirrored[i] || !is_upright[vertex]) continue;
      if (copy[vertex] == 0) {
        copy[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.copied_vertices.push_back(vertex);
        mesh.positions.push_back(mesh.positions[vertex]);
        if (!mesh.normals.empty()) mesh.normals.push_back(mesh.normals[vertex]);
        if (!mesh.colors.empty()) mesh.colors.push_back(mesh.colors[vertex]);
        for (std::vector<Uv>& uvs : mesh.uvs) {
          if (!uvs.empty()) uvs.push_back(uvs[vertex]);
        }
      }
      vertex = copy[vertex];
    }
  }
}

}  // namespace

std::vector<Tangent> tangents_of(std::span<const Vec3> positions, std::span<const Vec3> normals,
                                 std::span<const Corners> triangles, std::span<const Uv> uvs) {
  std::vector<Vec3> sum(positions.size());
  std::vector<Tangent> tangents(positions.size());
  for (const Corners& t : triangles) {
    const Lie lie = lie_of(positions, uvs, t);
    const Vec3 face =
        normalize(cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]));
    for (std::size_t k = 0; k < 3; ++k) {
      sum[t[k]] += lie.along * angle_at(positions, t, k);
      // Normals of the file may point the other way than the corners go round.
      const bool inside_out = !normals.empty() && dot(normals[t[k]], face) < 0;
      tangents[t[k]].side = lie.mirrored == inside_out ? 1.0f : -1.0f;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const Vec3 normal = normals.empty() ? Vec3{} : normals[i];
    const Vec3 flat = sum[i] - normal * dot(normal, sum[i]);
    const bool has_direction = length(flat) > 1e-6f;
    tangents[i].direction =
        has_direction ? normalize(flat) : (normals.empty() ? Vec3{1, 0, 0} : Frame(normal).x);
  }
  return tangents;
}

void derive_tangents(TriangleMesh& mesh, std::size_t uv_set) {
  if (!mesh.tangents.empty()) return;
  part_mirrored(mesh, uv_set);
  mesh.tangent_uv_set = static_cast<int>(uv_set);
  mesh.tangents = tangents_of(mesh.positions, mesh.normals, mesh.triangles, mesh.uvs[uv_set]);
}

std::vector<Tangent> tangents_of(const TriangleMesh& mesh, const MeshShape& shape) {
  return tangents_of(shape.positions, shape.normals, mesh.triangles,
                     mesh.uvs[static_cast<std::size_t>(mesh.tangent_uv_set)]);
}

}  // namespace baton
