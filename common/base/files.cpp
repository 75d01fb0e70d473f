#include "common/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "common/base/file_descriptor.h"
#include "common/base/limits.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

Error io_error(std::string_view what, const fs::path& path) {
  const bool is_full = errno == ENOSPC || errno == EDQUOT;
  return {is_full ? ErrorKind::no_space : ErrorKind::io,
          fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno))};
}

Status sync_path(const fs::path& path, int flags) {
  const FileDescriptor file(::open(path.c_str(), flags | O_CLOEXEC));
  if (!file) return io_error("cannot open to sync", path);
  if (::fsync(file.number()) != 0) return io_error("cannot sync", path);
  return {};
}

Status write_all(int fd, ByteView bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return io_error("cannot write", path);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

}  // namespace

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Status expect_file(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error)) return {};
  return Error{ErrorKind::bad_input, fmt::format("{}: no such file", path.string())};
}

namespace {

/// Content: Bytes or std::string.
template <class Content>
Result<Content> read_whole(const fs::path& path, std::uint64_t max_size_bytes) {
  // O_NONBLOCK: a named pipe must not make us wait for its writer.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) return io_error("cannot open", path);
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: is a folder, expected a file", path.string())};
  }
  if (!fs::is_regular_file(path, error)) {
    return Error{ErrorKind::bad_input, fmt::format("{}: is no plain file", path.string())};
  }
  const std::uint64_t size = fs::file_size(path, error);
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", path.string(), error.message())};
  if (size > max_size_bytes) {
    return Error{ErrorKind::bad_input, fmt::format("{}: {} bytes, at most {} are read",
                                                   path.string(), size, max_size_bytes)};
  }
  Content bytes(size, {});
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::read(file.number(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return io_error("cannot read", path);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace

Result<Bytes> read_file(const fs::path& path, std::uint64_t max_size_bytes) {
  return read_whole<Bytes>(path, max_size_bytes);
}

Result<std::string> read_text_file(const fs::path& path, std::uint64_t max_size_bytes) {
  return read_whole<std::string>(path, max_size_bytes);
}

fs::path temporary_sibling(const fs::path& path) {
  static std::atomic<std::uint64_t> counter{0};
  fs::path temporary = path;
  temporary.replace_filename(
      fmt::format(".{}.{}.{}.tmp", path.filename().string(), ::getpid(), counter.fetch_add(1)));
  return temporary;
}

Status publish_file(const fs::path& temporary, const fs::path& path) {
  BATON_TRY(sync_path(temporary, O_RDONLY));
  if (::rename(temporary.c_str(), path.c_str()) != 0) return io_error("cannot rename to", path);
  return sync_folder(path.has_parent_path() ? path.parent_path() : fs::path("."));
}

Status sync_folder(const fs::path& folder) { return sync_path(folder, O_RDONLY | O_DIRECTORY); }

namespace {

/// Writes a temporary file beside `path`, then lets `publish` turn it into `path`; nothing is left
/// behind on failure.
template <class Publish>
Status write_then(const fs::path& path, ByteView bytes, Publish publish) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) {
    errno = error.value();  // a disk may be full already
    return io_error("cannot create", path.parent_path());
  }
  const fs::path temporary = temporary_sibling(path);
  {
    FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!file) return io_error("cannot create", temporary);
    Status written = write_all(file.number(), bytes, temporary);
    if (!file.close() && written) written = io_error("cannot write", temporary);
    if (!written) {
      ::unlink(temporary.c_str());
      return written;
    }
  }
  Status published = publish(temporary);
  if (!published) ::unlink(temporary.c_str());
  return published;
}

}  // namespace

Status write_file_atomic(const fs::path& path, ByteView bytes) {
  return write_then(path, bytes,
                    [&](const fs::path& temporary) { return publish_file(temporary, path); });
}

Status expect_content(const fs::path& path, ByteView bytes) {
  BATON_ASSIGN(const Bytes stored, read_file(path, limits::kMaxAssetFileBytes));
  if (stored.size() != bytes.size()) {
    return Error{ErrorKind::corrupt, fmt::format("{}: {} bytes on disk, wrote {}", path.string(),
                                                 stored.size(), bytes.size())};
  }
  if (stored.empty() || std::memcmp(stored.data(), bytes.data(), bytes.size()) == 0) return {};
  const auto differs = std::mismatch(stored.begin(), stored.end(), bytes.begin());
  return Error{ErrorKind::corrupt,
               fmt::format("{}: byte {} is {:02x} on disk, wrote {:02x}", path.string(),
                           differs.first - stored.begin(), std::to_integer<int>(*differs.first),
                           std::to_integer<int>(*differs.second))};
}

Status write_file_verified(const fs::path& path, ByteView bytes,
                           const std::function<Status(const fs::path& temporary)>& check) {
  return write_then(path, bytes, [&](const fs::path& temporary) -> Status {
    BATON_TRY(sync_path(temporary, O_RDONLY));
    BATON_TRY(check(temporary));
    BATON_TRY(expect_content(temporary, bytes));
    return publish_file(temporary, path);
  });
}

Status write_file_unsynced(const fs::path& path, ByteView bytes) {
  return write_then(path, bytes, [&](const fs::path& temporary) -> Status {
    if (::rename(temporary.c_str(), path.c_str()) != 0) return io_error("cannot rename to", path);
    return {};
  });
}

Status expect_space(const fs::path& folder, std::uint64_t size_bytes, std::uint64_t reserve_bytes) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error) return {};  // whoever writes will be told
  const std::uint64_t reserve = std::min<std::uint64_t>(reserve_bytes, space.capacity / 20);
  if (space.available >= size_bytes + reserve) return {};
  constexpr double kMiB = 1 << 20;
  return Error{
      ErrorKind::no_space,
      fmt::format("{}: {:.1f} MiB are free, {:.1f} MiB are left to frames and the journal, "
                  "and {:.1f} MiB are to be written",
                  folder.string(), static_cast<double>(space.available) / kMiB,
                  static_cast<double>(reserve) / kMiB, static_cast<double>(size_bytes) / kMiB)};
}

Status sync_file_system(const fs::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return io_error("cannot open to sync", path);
  if (::syncfs(file.number()) != 0) return io_error("cannot sync the file system of", path);
  return {};
}

}  // namespace baton
