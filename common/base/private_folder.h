#pragma once

#include <filesystem>
#include <utility>

#include "common/base/result.h"

namespace baton {

/// A new folder that only this user may enter, for sockets: its path is short enough for them (107
/// bytes with a name). It goes away with this.
class PrivateFolder {
 public:
  /// In $XDG_RUNTIME_DIR, or else in the folder for temporary files. Errors: io.
  static Result<PrivateFolder> make();
  /// Removes one that a process before has left, with the sockets in it; anything else stays.
  static void remove_left(const std::filesystem::path& path);
  /// None.
  PrivateFolder() = default;
  PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  PrivateFolder& operator=(PrivateFolder&& other) noexcept {
    std::swap(path_, other.path_);
    return *this;
  }
  ~PrivateFolder();

  const std::filesystem::path& path() const { return path_; }

 private:
  explicit PrivateFolder(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
};

}  // namespace baton
