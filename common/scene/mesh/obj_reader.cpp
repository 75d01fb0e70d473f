#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>

#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/mesh/mesh_readers.h"

namespace baton {
namespace {

/// One thread of the process is in assimp at a time: its file systems and loaders share what
/// nothing guards.
std::mutex& assimp_mutex() {
  static std::mutex mutex;
  return mutex;
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
    if (with_uvs && part.HasTextureCoords(0) && !finite(part.mTextureCoords[0][i]))
      return "vertex " + std::to_string(i) + " has texture coordinates that are not finite";
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

/// True when every vertex of a part comes with a usable normal.
bool has_normals(const aiMesh* part) {
  const auto usable = [](const aiVector3D& n) { return finite(n) && n.SquareLength() > 0; };
  return part->HasNormals() &&
         std::all_of(part->mNormals, part->mNormals + part->mNumVertices, usable);
}

void add_part(const aiMesh& part, const MeshParts& parts, MeshBuilder& builder) {
  builder.begin_part(part.mNumVertices);
  for (const aiFace& face : std::span(part.mFaces, part.mNumFaces)) {
    if (face.mNumIndices != 3) continue;  // points and lines
    const std::array<std::uint32_t, 3> vertices{face.mIndices[0], face.mIndices[1],
                                                face.mIndices[2]};
    std::array<Vec3, 3> corners, normals;
    std::array<UvSets, 3> uvs{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t index = vertices[k];
      const aiVector3D& p = part.mVertices[index];
      corners[k] = {p.x, p.y, p.z};
      // In these files v grows upward.
      if (parts.uv_sets > 0)
        uvs[k][0] = {part.mTextureCoords[0][index].x, 1 - part.mTextureCoords[0][index].y};
      if (!parts.normals) continue;
      const aiVector3D& n = part.mNormals[index];
      normals[k] = normalize({n.x, n.y, n.z});
    }
    builder.add(vertices, corners, normals, uvs);
  }
}

}  // namespace

Result<TriangleMesh> read_obj(const std::string& path, bool with_normals, bool with_uvs) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, path + ": " + what};
  };
  std::unique_lock lock(assimp_mutex());
  Assimp::Importer importer;
  const aiScene* file = importer.ReadFile(path, 0);
  if (file == nullptr || file->mRootNode == nullptr)
    return fail(std::string("not a mesh: ") + importer.GetErrorString());
  if (file->mNumMeshes == 0) return fail("not a mesh: nothing found in it");
  for (const aiMesh* const part : std::span(file->mMeshes, file->mNumMeshes)) {
    if (const auto fault = find_fault(*part, with_uvs)) return fail(*fault);
  }
  file = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (file == nullptr || file->mRootNode == nullptr)
    return fail(std::string("not a mesh: ") + importer.GetErrorString());
  lock.unlock();

  const std::span read(file->mMeshes, file->mNumMeshes);
  const auto has_uvs = [](const aiMesh* part) { return part->HasTextureCoords(0); };
  const MeshParts parts{.normals = with_normals && std::ranges::all_of(read, has_normals),
                        .uv_sets = with_uvs && std::ranges::all_of(read, has_uvs) ? 1 : 0};
  MeshBuilder builder(parts);
  for (const aiMesh* const part : read) add_part(*part, parts, builder);
  return builder.take();
}

}  // namespace baton
