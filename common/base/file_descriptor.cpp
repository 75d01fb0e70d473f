#include "common/base/file_descriptor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>

namespace baton {

Result<std::optional<FileDescriptor>> try_lock_file(const std::filesystem::path& path) {
  FileDescriptor lock(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!lock)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot open: {}", path.string(), std::strerror(errno))};
  if (::flock(lock.number(), LOCK_EX | LOCK_NB) == 0)
    return std::optional<FileDescriptor>(std::move(lock));
  if (errno == EWOULDBLOCK) return std::optional<FileDescriptor>();
  return Error{ErrorKind::io,
               fmt::format("{}: cannot lock: {}", path.string(), std::strerror(errno))};
}

}  // namespace baton
