#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/base/bytes.h"
#include "common/base/file_stamp.h"
#include "common/base/limits.h"
#include "common/base/result.h"
#include "common/job/task.h"

namespace baton {

/// What was in a file when all of it was read.
struct FileContent {
  std::filesystem::path path;
  /// Before it was read; nullopt: it was not there, or could not be looked at.
  std::optional<FileStamp> stamp;
  std::optional<Digest> digest;  ///< nullopt: it was not read
  /// Why it could not be looked at or read, with its name.
  std::string fault;
  /// The job in the header of a frame that is a whole picture; empty where there is none.
  std::optional<std::string> writer = {};
  /// The digest is one that was expected, so that nobody looked for the writer.
  bool is_expected = false;
};

/// How a file stands beside what was recorded when it was written.
enum class FileState : std::uint8_t {
  /// Only its bytes can tell, and they were not read.
  unknown,
  right,    ///< has the size and digest
  absent,   ///< nothing has its name
  damaged,  ///< was cut, or is no picture
  /// A frame: a whole picture, but another one.
  strange,
  unreadable,  ///< cannot be looked at or read
};
struct FileVerdict {
  FileState state = FileState::unknown;
  std::string fault = {};   ///< of an unreadable one: why, with its name
  Digest digest = {};       ///< of a strange one
  std::string writer = {};  ///< likewise: FileContent::writer
};

/// All of a file. Errors: those of read_file.
Result<Bytes> read_whole_file(const std::filesystem::path& path);
/// How the file of a locked frame stands, whatever is in it: right, absent or unreadable.
FileVerdict judge_locked(const std::filesystem::path& path);
/// What was read, beside what was recorded; nullptr: nothing was.
FileVerdict judge_content(const FileContent* content, const BlobRef& recorded);

/// What is known of the contents of files, without reading any. It holds for a file as long as
/// that stands as it did when it was read.
class FileTable {
 public:
  void add(const FileContent& content);

  /// How the file stands now. Of a blob another size says that it is damaged; a frame of another
  /// size may be somebody's picture.
  FileVerdict judge(const std::filesystem::path& path, const BlobRef& recorded) const;
  /// Whether it is known to be as recorded.
  bool is_right(const std::filesystem::path& path, const BlobRef& recorded) const {
    return judge(path, recorded).state == FileState::right;
  }
  /// How the file stood when it had this digest; nullopt: that is not known.
  std::optional<FileStamp> stamp_with(const std::filesystem::path& path,
                                      const Digest& digest) const;

  /// The file is to be read anew, whatever its stamp says.
  void forget(const std::filesystem::path& path);
  /// So are those that could not be read.
  void forget_unread();

 private:
  static constexpr std::size_t kMaxFiles = 2 * limits::kMaxFrames;
  /// By normal path; forgotten all at once when there are kMaxFiles.
  std::map<std::filesystem::path, FileContent> files_;
  std::set<std::filesystem::path> unread_;  ///< of them, with a fault
};

}  // namespace baton
