#include "common/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>  // renameat2
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <random>
#include <string>
#include <utility>

#include "common/base/file_descriptor.h"
#include "common/base/limits.h"
#include "common/base/paths.h"

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
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) return {};
  if (errno != ENOENT && errno != ENOTDIR) return io_error("cannot look at it", path);
  return Error{ErrorKind::bad_input, fmt::format("{}: no such file", path.string())};
}

namespace {

/// Content: Bytes or std::string.
template <class Content>
Result<Content> read_whole(const fs::path& path, std::uint64_t max_size_bytes) {
  // O_NONBLOCK: a named pipe must not make us wait for its writer.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) return io_error("cannot open", path);
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) return io_error("cannot look at it", path);
  if (S_ISDIR(status.st_mode)) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: is a folder, expected a file", path.string())};
  }
  if (!S_ISREG(status.st_mode)) {
    return Error{ErrorKind::bad_input, fmt::format("{}: is no plain file", path.string())};
  }
  const auto size = static_cast<std::uint64_t>(status.st_size);
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

Status sync_folder(const fs::path& folder) { return sync_path(folder, O_RDONLY | O_DIRECTORY); }

namespace {

/// Error (bad_input): a folder that is held open is in none of these, wherever it was found.
Status expect_within(const FileDescriptor& folder, const Roots& roots) {
  if (roots.empty()) return {};
  std::error_code error;
  const fs::path found = fs::read_symlink(fmt::format("/proc/self/fd/{}", folder.number()), error);
  for (const fs::path& root : roots) {
    std::error_code none;
    const fs::path allowed = fs::canonical(root, none);
    if (!error && !none && lies_in(found, allowed)) return {};
  }
  return Error{ErrorKind::bad_input,
               fmt::format("{}: lies outside what --root allows", found.string())};
}

/// A new file beside `path` under a name that nobody can foresee, so that no link can lie in wait
/// for it. It goes away unless it is published.
class NewFile {
 public:
  /// Creates missing folders.
  static Result<NewFile> create(const fs::path& path, mode_t rights = 0644,
                                const Roots& roots = {}) {
    std::error_code error;
    if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
    if (error) {
      errno = error.value();  // a disk may be full already
      return io_error("cannot create", path.parent_path());
    }
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    FileDescriptor held(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!held) return io_error("cannot open", folder);
    BATON_TRY(expect_within(held, roots));
    std::random_device random;
    for (int attempt = 0;; ++attempt) {
      const std::string name = fmt::format(".{}.{:08x}{:08x}.tmp", path.filename().string(),
                                           std::uint32_t{random()}, std::uint32_t{random()});
      FileDescriptor file(::openat(held.number(), name.c_str(),
                                   O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, rights));
      if (file) return NewFile(path, name, std::move(held), std::move(file));
      if (errno != EEXIST || attempt == 100) return io_error("cannot create", folder / name);
    }
  }
  NewFile(NewFile&&) = default;
  ~NewFile() {
    if (folder_ && !is_published_) ::unlinkat(folder_.number(), name_.c_str(), 0);
  }

  /// Under its own name, to be read.
  fs::path path() const { return fs::path(path_).replace_filename(name_); }
  Status write(ByteView bytes) { return write_all(file_.number(), bytes, path()); }
  Status sync() {
    return ::fsync(file_.number()) == 0 ? Status() : io_error("cannot sync", path());
  }
  /// Gives it the name that it was made for.
  Status publish() {
    if (!file_.close()) return io_error("cannot write", path());
    const int folder = folder_.number();
    if (::renameat(folder, name_.c_str(), folder, path_.filename().c_str()) != 0)
      return io_error("cannot rename to", path_);
    is_published_ = true;
    return {};
  }
  /// Unless something has that name, seen from here or not. False: something has.
  Result<bool> publish_if_free() {
    if (!file_.close()) return io_error("cannot write", path());
    const int folder = folder_.number();
    const std::string name = path_.filename();
    int failed = ::renameat2(folder, name_.c_str(), folder, name.c_str(), RENAME_NOREPLACE);
    if (failed != 0 && (errno == EINVAL || errno == ENOSYS)) {  // such as NFS
      failed = ::linkat(folder, name_.c_str(), folder, name.c_str(), 0);
      if (failed == 0) ::unlinkat(folder, name_.c_str(), 0);
    }
    if (failed != 0 && errno == EEXIST) return false;
    // A disk that has neither can only replace.
    if (failed != 0 && (errno == EPERM || errno == EOPNOTSUPP || errno == ENOSYS)) {
      BATON_TRY(publish());
      return true;
    }
    if (failed != 0) return io_error("cannot rename to", path_);
    is_published_ = true;
    return true;
  }
  /// After publish(): its name survives a power cut.
  Status sync_name() const {
    return ::fsync(folder_.number()) == 0 ? Status() : io_error("cannot sync the folder of", path_);
  }

 private:
  NewFile(fs::path path, std::string name, FileDescriptor folder, FileDescriptor file)
      : path_(std::move(path)),
        name_(std::move(name)),
        folder_(std::move(folder)),
        file_(std::move(file)) {}

  fs::path path_;
  std::string name_;
  /// Held open: another one may not take its place.
  FileDescriptor folder_;
  FileDescriptor file_;
  bool is_published_ = false;
};

}  // namespace

Status write_file_atomic(const fs::path& path, ByteView bytes, const Roots& roots) {
  BATON_ASSIGN(NewFile file, NewFile::create(path, 0644, roots));
  BATON_TRY(file.write(bytes));
  BATON_TRY(file.sync());
  BATON_TRY(file.publish());
  return file.sync_name();
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

Result<bool> write_file_verified(
    const fs::path& path, ByteView bytes,
    const std::function<Result<bool>(const fs::path& temporary)>& may_replace, const Roots& roots) {
  BATON_ASSIGN(NewFile file, NewFile::create(path, 0644, roots));
  BATON_TRY(file.write(bytes));
  BATON_TRY(file.sync());
  BATON_TRY(expect_content(file.path(), bytes));
  BATON_ASSIGN(const bool replaces, may_replace(file.path()));
  if (replaces) {
    BATON_TRY(file.publish());
  } else {
    BATON_ASSIGN(const bool is_published, file.publish_if_free());
    if (!is_published) return false;
  }
  BATON_TRY(file.sync_name());
  return true;
}

Status write_file_unsynced(const fs::path& path, ByteView bytes, mode_t rights) {
  BATON_ASSIGN(NewFile file, NewFile::create(path, rights));
  BATON_TRY(file.write(bytes));
  return file.publish();
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
