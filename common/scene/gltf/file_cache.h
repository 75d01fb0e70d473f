#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/scene/gltf/document.h"

namespace baton::gltf {

/// Reads each file once. Not for several threads.
class FileCache {
 public:
  Result<std::shared_ptr<const Document>> get(const std::string& path) {
    if (const auto found = files_.find(path); found != files_.end()) return found->second;
    Result<std::shared_ptr<const Document>> document = read_document(path);
    files_.emplace(path, document);
    return document;
  }

 private:
  std::map<std::string, Result<std::shared_ptr<const Document>>> files_;
};

}  // namespace baton::gltf
