#include "common/base/file_stamp.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

namespace baton {

Result<std::optional<FileStamp>> stamp_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    if (errno == ENOENT || errno == ENOTDIR) {
      // Where a link leads may come back; the file that is there is not this one's absence.
      struct stat link {};
      if (::lstat(path.c_str(), &link) != 0) return std::optional<FileStamp>();
      return Error{ErrorKind::bad_input,
                   path.string() + ": is a link that leads nowhere, expected a file"};
    }
    if (errno == ELOOP)
      return Error{ErrorKind::bad_input, path.string() + ": is a loop of links, expected a file"};
    return Error{ErrorKind::io, fmt::format("{}: {}", path.string(), std::strerror(errno))};
  }
  if (!S_ISREG(status.st_mode)) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: is {}, expected a file", path.string(),
                             S_ISDIR(status.st_mode) ? "a folder" : "no plain file")};
  }
  const auto ns_of = [](const timespec& time) {
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  };
  // Bytes that are older than how the file is kept: the usual case, in which the latter says all.
  // Otherwise a clock was ahead, or the file system has no such time, and both count.
  const std::int64_t written = ns_of(status.st_mtim), kept = ns_of(status.st_ctim);
  const std::uint64_t both =
      static_cast<std::uint64_t>(written) * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(kept);
  return std::optional(
      FileStamp{.size_bytes = static_cast<std::uint64_t>(status.st_size),
                .inode = status.st_ino,
                .time_ns = written > kept ? static_cast<std::int64_t>(both) : kept});
}

}  // namespace baton
