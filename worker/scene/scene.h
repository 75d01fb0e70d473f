#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "worker/scene/material.h"

namespace baton {

/// Texture coordinates, (0, 0) at the upper left of the image; sets 0 and 1.
using Uv = std::array<float, 2>;
using UvSets = std::array<Uv, 2>;

/// Which way the first texture coordinate grows.
struct Tangent {
  Vec3 direction;  ///< unit, at a right angle to the normal
  float side = 1;  ///< side * cross(normal, direction) points up in the image: 1 or -1

  bool operator==(const Tangent&) const = default;
};

/// Triangles of one file. Degenerate triangles (zero area, equal corners) are dropped and counted.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;             ///< per vertex, unit; empty: flat shading
  std::array<std::vector<Uv>, 2> uvs{};  ///< by set, per vertex, or empty
  std::vector<Tangent> tangents{};       ///< per vertex, where a normal map needs them, or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint64_t dropped_triangles = 0;
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

  bool is_catcher = false;  ///< seen by catcher.h alone, not by the ray tracer

  bool moves() const { return moving_object >= 0; }
};

/// All geometry of a job; immutable once loaded, shared by all threads.
struct Scene {
  std::vector<TriangleMesh> meshes;
  std::vector<Material> materials;
  std::vector<Instance> instances;  ///< placed as without keys; pose.h moves them
  bool has_detail = false;          ///< some material has

  const Material& material_of(const Instance& instance) const {
    return materials[instance.material];
  }
  /// What meshes and textures take.
  std::uint64_t size_bytes() const;
};

/// Loads every mesh and resolves every name. The ground is a two-triangle mesh of its own.
Result<Scene> load_scene(const JobSpec& job);

}  // namespace baton
