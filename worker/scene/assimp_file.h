#pragma once

#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <memory>
#include <string>

#include "common/base/result.h"

namespace baton {

/// A file as assimp reads it. One thread of the process is in assimp at a time: its file systems
/// and loaders share what nothing guards.
class AssimpFile {
 public:
  /// what: as in "not a mesh", of the error. Missing, unreadable and odd files are bad_input.
  static Result<AssimpFile> read(const std::string& path, const std::string& what);

  /// Has a root node.
  const aiScene& scene() const { return *importer_->GetScene(); }
  /// Makes triangles of all faces, in place.
  Status triangulate();

 private:
  AssimpFile(std::string path, std::string what);
  Error fault() const;

  std::string path_, what_;
  std::unique_ptr<Assimp::Importer> importer_;
};

}  // namespace baton
