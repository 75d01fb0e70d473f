#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/scene/gltf/document.h"

namespace baton::gltf {

/// Reads each file once. Not for several threads.
class FileCache {
 public:
  /// listed: as for read_document.
  explicit FileCache(std::optional<std::set<std::string>> listed = {})
      : listed_(std::move(listed)) {}
  Result<std::shared_ptr<const Document>> get(const std::string& path) {
    if (const auto found = files_.find(path); found != files_.end()) return found->second;
    Result<std::shared_ptr<const Document>> document = read_document(path, listed());
    files_.emplace(path, document);
    return document;
  }

  const std::set<std::string>* listed() const { return listed_ ? &*listed_ : nullptr; }

 private:
  std::optional<std::set<std::string>> listed_;
  std::map<std::string, Result<std::shared_ptr<const Document>>> files_;
};

}  // namespace baton::gltf
