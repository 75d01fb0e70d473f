#pragma once

#include <unistd.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "common/base/result.h"

namespace baton {

/// An open file of the system, which is closed with the object. Below 0: none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor() { close(); }

  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }
  /// Closes now; false: some file systems tell only then that they could not write.
  bool close() { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

/// Locks a file, which is made where there is none, until the result is closed. None: another
/// process has it locked. Error, io: the disk.
Result<std::optional<FileDescriptor>> try_lock_file(const std::filesystem::path& path);

}  // namespace baton
