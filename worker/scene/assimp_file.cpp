#include "worker/scene/assimp_file.h"

#include <assimp/postprocess.h>

#include <mutex>

namespace baton {
namespace {

std::mutex& assimp_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

AssimpFile::AssimpFile(std::string path, std::string what)
    : path_(std::move(path)), what_(std::move(what)) {}

Error AssimpFile::fault() const {
  return {ErrorKind::bad_input, path_ + ": not " + what_ + ": " + importer_->GetErrorString()};
}

Result<AssimpFile> AssimpFile::read(const std::string& path, const std::string& what) {
  const std::lock_guard lock(assimp_mutex());
  AssimpFile file(path, what);
  // assimp throws on some odd files instead of saying so.
  try {
    file.importer_ = std::make_unique<Assimp::Importer>();
    const aiScene* const scene = file.importer_->ReadFile(path, 0);
    if (scene == nullptr || scene->mRootNode == nullptr) return file.fault();
  } catch (const std::exception& e) {
    return Error{ErrorKind::bad_input, path + ": not " + what + ": " + e.what()};
  }
  return file;
}

Status AssimpFile::triangulate() {
  const std::lock_guard lock(assimp_mutex());
  const aiScene* const scene = importer_->ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) return fault();
  return {};
}

}  // namespace baton
