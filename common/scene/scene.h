#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/limits.h"
#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/scene/material/material.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// A mesh placed in the world.
struct Instance {
  std::uint32_t mesh = 0;
  std::uint32_t material = 0;
  Transform to_world;
  Mat3 normal_to_world;  ///< inverse transpose of to_world.linear
  /// Index of the job's object, where that has keys; else -1.
  std::int32_t moving_object = -1;

  /// It catches shadows: rays that look for objects pass it.
  bool is_catcher = false;
  bool deforms = false;  ///< its mesh does
  /// In a pose: to_world is singular, and no ray meets it.
  bool is_absent = false;

  bool moves() const { return moving_object >= 0 || deforms; }
};

/// All geometry of a job; immutable once loaded, shared by all threads.
struct Scene {
  std::vector<TriangleMesh> meshes;
  std::vector<Material> materials;
  /// Instances placed as without keys; pose.h moves them.
  std::vector<Instance> instances;
  bool has_detail = false;   ///< some material has
  bool has_catcher = false;  ///< some instance is one

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

/// Which files beside those that a job names its glTF files may lead to.
enum class FilesBeside {
  any,
  /// Those in SceneSpec::files, which settle_scene() has found.
  listed,
};

/// Loads every mesh and resolves every name. The ground is a two-triangle mesh of its own.
/// max_texture_bytes: no more textures are read than that.
Result<Scene> load_scene(const JobSpec& job, FilesBeside beside = FilesBeside::any,
                         std::uint64_t max_texture_bytes = limits::kMaxTextureBytes);

}  // namespace baton
