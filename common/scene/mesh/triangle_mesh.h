#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/scene/mesh/deformation.h"

namespace baton {

/// Texture coordinates, (0, 0) at the upper left of the image; sets 0 and 1.
using Uv = std::array<float, 2>;
using UvSets = std::array<Uv, 2>;

/// What of a file is unusable, and so made anew or left out where it is; counted.
struct MeshRepairs {
  /// Vertices without a usable normal, which take that of the faces around.
  std::uint64_t normals = 0;
  /// Vertices without a usable tangent, which take that of the coordinates.
  std::uint64_t tangents = 0;
  /// Vertices that no joint holds, which follow the first one.
  std::uint64_t weights = 0;
  /// Joint weights that are below 0 or not finite, or whose joint has no finite matrix: they are 0.
  std::uint64_t holds = 0;
  /// Steps of morph targets that are not finite: they are 0.
  std::uint64_t steps = 0;
  /// Corners without usable texture coordinates, which have (0, 0).
  std::uint64_t uvs = 0;
  /// Faces with a corner whose place is not finite, which are not shown.
  std::uint64_t nowhere = 0;
  /// Repetitions of a mesh whose place is not finite, which are not shown.
  std::uint64_t instances = 0;
  /// Faces whose edges cross, or that have too many corners, cut around their first.
  std::uint64_t crossing = 0;
  /// Points, lines and faces of fewer than three corners, which are not shown.
  std::uint64_t lines = 0;
  /// Vertices whose colour is no four numbers in [0, 1]: cut, or 1 where it is no number.
  std::uint64_t colors = 0;
  /// Vertices and faces with colours in a form that is not read.
  std::uint64_t unread_colors = 0;
  /// Curves and surfaces that formulas describe, which are not shown.
  std::uint64_t formulas = 0;
  /// Lines of a text whose first word says nothing that is known.
  std::uint64_t unread_lines = 0;
  /// Indices at the end of a list of triangles that make none.
  std::uint64_t spare_indices = 0;
  /// Parts that bones or morph weights leave no area.
  std::uint64_t shrunk = 0;

  bool operator==(const MeshRepairs&) const = default;
  MeshRepairs& operator+=(const MeshRepairs& other);
};

/// A kind of repair, and what is said of it after its count.
struct RepairKind {
  std::uint64_t MeshRepairs::*count;
  std::string_view what;
};
/// All members of MeshRepairs.
std::span<const RepairKind> repair_kinds();

/// Coordinates as a file has them.
using Position = std::array<double, 3>;

/// Factor of base colour and alpha at a vertex, linear.
using VertexColor = std::array<float, 4>;
/// A channel of a colour as it counts: cut to [0, 1], and 1 where it is no number. is_sound: set to
/// false where that is more than rounding.
float color_channel(double value, bool& is_sound);

/// Triangles of one file. Degenerate triangles (zero area, equal corners) are dropped and counted;
/// where the mesh deforms, those with equal corners alone.
struct TriangleMesh {
  std::vector<Vec3> positions;  ///< from `origin`
  /// Where positions count from, in the space of the file: 0, unless they are far away.
  Position origin{};
  std::vector<Vec3> normals{};           ///< per vertex, unit; empty: flat shading
  std::array<std::vector<Uv>, 2> uvs{};  ///< by set, per vertex, or empty
  /// Tangents per vertex, where a normal map needs them, or empty.
  std::vector<Tangent> tangents{};
  std::vector<VertexColor> colors{};  ///< per vertex, or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint64_t dropped_triangles = 0;
  MeshRepairs repairs{};
  /// How the vertices move, the arrays above being those of the frame at time 0; null: not at all.
  std::shared_ptr<const Deformation> deformation{};
  /// Those of which the last vertices are copies, which it does not know (tangents.h).
  std::vector<std::uint32_t> copied_vertices{};
  int tangent_uv_set = -1;  ///< whose tangents were derived; -1: none

  /// Where vertices are at a frame, of a mesh that deforms.
  MeshShape shape_at(double frame) const;
};

/// Where on a mesh a surface was hit.
struct SurfacePlace {
  std::uint32_t triangle = 0;
  /// Barycentric coordinates of the triangle's second and third corner.
  float u = 0, v = 0;
  /// Width of what the site sees, across the ray, in the world.
  float width = 0;

  bool operator==(const SurfacePlace&) const = default;
};

}  // namespace baton
