#include "common/scene/mesh_loader.h"

#include <algorithm>
#include <filesystem>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/scene/gltf/meshes.h"
#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/mesh/mesh_readers.h"

namespace baton {
namespace {

Error bad_mesh(const std::string& path, const std::string& what) {
  return {ErrorKind::bad_input, path + ": " + what};
}

/// Reads the triangles with the reader that fits the file.
Result<TriangleMesh> read_triangles(const std::string& path, bool smooth_normals, bool with_uvs,
                                    const std::set<std::string>* listed) {
  const std::string extension = lower_extension(path);
  if (extension == ".off") {
    BATON_ASSIGN(const std::string text, read_text_file(path, limits::kMaxAssetFileBytes));
    return parse_off(text, path);
  }
  if (extension == ".ply") {
    BATON_ASSIGN(const std::string bytes, read_text_file(path, limits::kMaxAssetFileBytes));
    return parse_ply(bytes, path, smooth_normals);
  }
  if (extension == ".gltf" || extension == ".glb") {
    BATON_ASSIGN(const auto document, gltf::read_document(path, listed));
    return gltf::whole_mesh(*document, smooth_normals);
  }
  BATON_ASSIGN(const std::string text, read_text_file(path, limits::kMaxAssetFileBytes));
  return parse_obj(text, path, smooth_normals, with_uvs);
}

}  // namespace

Result<TriangleMesh> load_mesh(const std::string& path, bool smooth_normals, bool with_uvs,
                               const std::set<std::string>* listed) {
  // Look at the file before any reader does.
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
  if (!stamp) return bad_mesh(path, "missing: expected a mesh file");
  if (stamp->size_bytes > limits::kMaxAssetFileBytes) {
    return bad_mesh(path, "larger than " + std::to_string(limits::kMaxAssetFileBytes) + " bytes");
  }

  BATON_ASSIGN(TriangleMesh mesh, read_triangles(path, smooth_normals, with_uvs, listed));
  if (mesh.triangles.empty()) {
    return bad_mesh(path, "no triangles (" + std::to_string(mesh.dropped_triangles) +
                              " without area); points and lines are not shown");
  }
  if (smooth_normals && mesh.normals.empty())
    mesh.normals = smooth_vertex_normals(mesh.positions, mesh.triangles);
  return mesh;
}

}  // namespace baton
