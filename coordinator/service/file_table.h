#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>

#include "common/base/limits.h"
#include "common/base/result.h"
#include "common/job/task.h"

namespace baton {

/// How a file stands in its folder; one that was written again differs in some of it.
struct FileStamp {
  std::uint64_t size_bytes = 0, inode = 0;
  std::int64_t time_ns = 0;  ///< of the last change of the bytes

  bool operator==(const FileStamp&) const = default;
};

/// What was in a file when all of it was read.
struct FileContent {
  std::filesystem::path path;
  FileStamp stamp;               ///< before it was read
  std::optional<Digest> digest;  ///< nullopt: it could not be read
};

/// Reads all of a file. Errors: those of read_file.
Result<Digest> digest_of_file(const std::filesystem::path& path);
/// nullopt: the file is not there, or cannot be looked at.
std::optional<FileStamp> stamp_of(const std::filesystem::path& path);

/// What is known of the contents of files, without reading any. It holds for a file as long as
/// that stands as it did when it was read.
class FileTable {
 public:
  void add(const FileContent& content);

  /// Whether only its bytes can tell if the file is as it was recorded, and they are not known.
  bool must_be_read(const std::filesystem::path& path, const BlobRef& recorded) const;

  /// Whether the file has the size and digest that were recorded when it was written; nullopt: this
  /// is not known, or could not be found out. What could not be read is to be read anew after that.
  std::optional<bool> holds(const std::filesystem::path& path, const BlobRef& recorded);
  /// The file is to be read anew, whatever its stamp says.
  void forget(const std::filesystem::path& path) { files_.erase(path.lexically_normal()); }

 private:
  struct Entry {
    FileStamp stamp;
    std::optional<Digest> digest;
  };
  static constexpr std::size_t kMaxFiles = 2 * limits::kMaxFrames;
  /// By normal path; forgotten all at once when there are kMaxFiles.
  std::map<std::filesystem::path, Entry> files_;
};

}  // namespace baton
