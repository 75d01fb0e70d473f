#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "worker/scene/deformation.h"
#include "worker/scene/material.h"

namespace baton {

/// Texture coordinates, (0, 0) at the upper left of the image; sets 0 and 1.
using Uv = std::array<float, 2>;
using UvSets = std::array<Uv, 2>;

/// Triangles of one file. Degenerate triangles (zero area, equal corners) are dropped and counted;
/// where the mesh deforms, those with equal corners alone.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;             ///< per vertex, unit; empty: flat shading
  std::array<std::vector<Uv>, 2> uvs{};  ///< by set, per vertex, or empty
  std::vector<Tangent> tangents{};       ///< per vertex, where a normal map needs them, or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint64_t dropped_triangles = 0;
  /// How the vertices move, the arrays above being those of the frame at time 0; null: not at all.
  std::shared_ptr<const Deformation> deformation{};
  /// Those of which the last vertices are copies, which it does not know (tangents.h).
  std::vector<std::uint32_t> copied_vertices{};
  int tangent_uv_set = -1;  ///< whose tangents were derived; -1: none

  /// Where vertices are at a frame, of a mesh that deforms.
  MeshShape shape_at(double frame) const;
};

/// Reads .ply .obj .off .gltf .glb. with_uvs: of .obj files, too, whose vertices then part where
/// their texture coordinates do. Errors name the file: missing, not a mesh, no triangles,
/// indices out of range, coordinates that are not finite.
Result<TriangleMesh> load_mesh(const std::string& path, bool smooth_normals, bool with_uvs = false);

/// A mesh placed in the world.
struct Instance {
  std::uint32_t mesh = 0;
  std::uint32_t material = 0;
  Transform to_world;
  Mat3 normal_to_world;             ///< inverse transpose of to_world.linear
  std::int32_t moving_object = -1;  ///< index of the job's object, where that has keys; else -1

  bool is_catcher = false;  ///< catches shadows: rays that look for objects pass it
  bool deforms = false;     ///< its mesh does
  bool is_absent = false;   ///< in a pose: to_world is singular, and no ray meets it

  bool moves() const { return moving_object >= 0 || deforms; }
};

/// All geometry of a job; immutable once loaded, shared by all threads.
struct Scene {
  std::vector<TriangleMesh> meshes;
  std::vector<Material> materials;
  std::vector<Instance> instances;  ///< placed as without keys; pose.h moves them
  bool has_detail = false;          ///< some material has
  bool has_catcher = false;         ///< some instance is one

  const Material& material_of(const Instance& instance) const {
    return materials[instance.material];
  }
  /// What meshes and textures take.
  std::uint64_t size_bytes() const;
};

/// The shapes of meshes in a frame, by mesh; null, or beyond its end: as the scene has the mesh.
using MeshShapes = std::vector<std::shared_ptr<const MeshShape>>;

/// The vertices of a mesh as they are in a frame, whether it deforms or not.
struct MeshVertices {
  std::span<const Vec3> positions, normals;  ///< normals: empty where shading is flat
  std::span<const Tangent> tangents;
};
MeshVertices vertices_of(const Scene& scene, const MeshShapes& shapes, std::uint32_t mesh);

/// Loads every mesh and resolves every name. The ground is a two-triangle mesh of its own.
Result<Scene> load_scene(const JobSpec& job);

}  // namespace baton
