#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "worker/scene/assimp_file.h"
#include "worker/scene/gltf/meshes.h"
#include "worker/scene/mesh_builder.h"
#include "worker/scene/mesh_readers.h"

namespace baton {
namespace {

Error bad_mesh(const std::string& path, const std::string& what) {
  return {ErrorKind::bad_input, path + ": " + what};
}

bool finite(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Looks at every coordinate and index before anything follows them.
std::optional<std::string> find_fault(const aiMesh& part, bool with_uvs) {
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    if (!finite(part.mVertices[i])) {
      return "vertex " + std::to_string(i) + " has a coordinate that is not finite";
    }
    for (unsigned set = 0; with_uvs && set < 2; ++set) {
      if (part.HasTextureCoords(set) && !finite(part.mTextureCoords[set][i]))
        return "vertex " + std::to_string(i) + " has texture coordinates that are not finite";
    }
  }
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    for (unsigned k = 0; k < part.mFaces[f].mNumIndices; ++k) {
      if (const unsigned index = part.mFaces[f].mIndices[k]; index >= part.mNumVertices) {
        return "face " + std::to_string(f) + ": expected a vertex index below " +
               std::to_string(part.mNumVertices) + ", found " + std::to_string(index);
      }
    }
  }
  return std::nullopt;
}

/// True when every vertex of the file comes with a usable normal.
bool has_normals(const aiScene& file) {
  const auto usable = [](const aiVector3D& n) { return finite(n) && n.SquareLength() > 0; };
  return std::all_of(file.mMeshes, file.mMeshes + file.mNumMeshes, [&](const aiMesh* part) {
    return part->HasNormals() &&
           std::all_of(part->mNormals, part->mNormals + part->mNumVertices, usable);
  });
}

/// How many sets of texture coordinates all parts of the file have.
int num_uv_sets(const aiScene& file) {
  const auto all_have = [&](unsigned set) {
    return std::all_of(file.mMeshes, file.mMeshes + file.mNumMeshes,
                       [&](const aiMesh* part) { return part->HasTextureCoords(set); });
  };
  if (!all_have(0)) return 0;
  return all_have(1) ? 2 : 1;
}

/// Adds the triangles of `part`, moved by `to_file`.
void add_part(const aiMesh& part, const aiMatrix4x4& to_file, const MeshParts& parts,
              MeshBuilder& builder) {
  const bool mirrored = to_file.Determinant() < 0;
  aiMatrix3x3 normal_to_file(to_file);
  normal_to_file.Inverse().Transpose();
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    std::array<Vec3, 3> corners, normals;
    std::array<UvSets, 3> uvs{};
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned index = face.mIndices[mirrored ? 2 - k : k];
      const aiVector3D p = to_file * part.mVertices[index];
      corners[k] = {p.x, p.y, p.z};
      // In these files v grows upward.
      for (unsigned set = 0; set < static_cast<unsigned>(parts.uv_sets); ++set)
        uvs[k][set] = {part.mTextureCoords[set][index].x, 1 - part.mTextureCoords[set][index].y};
      if (!parts.normals) continue;
      const aiVector3D n = normal_to_file * part.mNormals[index];
      normals[k] = normalize({n.x, n.y, n.z});
    }
    builder.add(corners, normals, uvs);
  }
}

/// Adds all parts at and below `node`.
void add_node(const aiScene& file, const aiNode& node, const aiMatrix4x4& parent,
              const MeshParts& parts, MeshBuilder& builder) {
  const aiMatrix4x4 to_file = parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    add_part(*file.mMeshes[node.mMeshes[m]], to_file, parts, builder);
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    add_node(file, *node.mChildren[c], to_file, parts, builder);
  }
}

Result<TriangleMesh> load_with_assimp(const std::string& path, bool smooth_normals, bool with_uvs) {
  BATON_ASSIGN(AssimpFile file, AssimpFile::read(path, "a mesh"));
  const aiScene& read = file.scene();
  if (read.mNumMeshes == 0) return bad_mesh(path, "not a mesh: nothing found in it");
  for (unsigned m = 0; m < read.mNumMeshes; ++m) {
    if (const auto fault = find_fault(*read.mMeshes[m], with_uvs)) return bad_mesh(path, *fault);
  }
  BATON_TRY(file.triangulate());
  const aiScene& scene = file.scene();
  const bool with_normals = smooth_normals && has_normals(scene);
  const MeshParts parts{.normals = with_normals, .uv_sets = with_uvs ? num_uv_sets(scene) : 0};
  MeshBuilder builder(parts);
  add_node(scene, *scene.mRootNode, aiMatrix4x4(), parts, builder);
  return builder.take();
}

/// Reads the triangles with the reader that fits the file.
Result<TriangleMesh> read_triangles(const std::string& path, bool smooth_normals, bool with_uvs) {
  const std::string extension = std::filesystem::path(path).extension().string();
  const auto is = [&](std::string_view e) {
    return std::equal(extension.begin(), extension.end(), e.begin(), e.end(), [](char a, char b) {
      return std::tolower(static_cast<unsigned char>(a)) == b;
    });
  };
  if (is(".off")) {
    BATON_ASSIGN(const std::string text, read_text_file(path, limits::kMaxAssetFileBytes));
    return parse_off(text, path);
  }
  if (is(".ply")) {
    BATON_ASSIGN(const std::string bytes, read_text_file(path, limits::kMaxAssetFileBytes));
    return parse_ply(bytes, path, smooth_normals);
  }
  if (is(".gltf") || is(".glb")) {
    BATON_ASSIGN(const auto document, gltf::read_document(path));
    return gltf::whole_mesh(*document, smooth_normals);
  }
  return load_with_assimp(path, smooth_normals, with_uvs);
}

}  // namespace

Result<TriangleMesh> load_mesh(const std::string& path, bool smooth_normals, bool with_uvs) {
  // Look at the file before any reader does.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return bad_mesh(path, "missing: expected a mesh file");
  if (!std::filesystem::is_regular_file(status))
    return bad_mesh(path, "expected a mesh file, found no regular file");
  if (std::filesystem::file_size(path, error) > limits::kMaxAssetFileBytes) {
    return bad_mesh(path, "larger than " + std::to_string(limits::kMaxAssetFileBytes) + " bytes");
  }

  // Postprocessing and odd files may throw.
  try {
    BATON_ASSIGN(TriangleMesh mesh, read_triangles(path, smooth_normals, with_uvs));
    if (mesh.triangles.empty()) {
      return bad_mesh(path,
                      "no triangles (" + std::to_string(mesh.dropped_triangles) + " without area)");
    }
    if (smooth_normals && mesh.normals.empty()) mesh.normals = smooth_vertex_normals(mesh);
    return mesh;
  } catch (const std::exception& e) {
    return bad_mesh(path, std::string("not a mesh: ") + e.what());
  }
}

}  // namespace baton
