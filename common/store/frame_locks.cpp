#include "common/store/frame_locks.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <sstream>

#include "common/base/file_stamp.h"
#include "common/base/files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxBytes = 64 << 20;
/// Others may remove the folder of locks, which was empty, before a file is in it.
constexpr int kMostTries = 8;

Error disk_error(const fs::path& path, const std::error_code& error) {
  return {ErrorKind::io, fmt::format("{}: {}", path.string(), error.message())};
}

/// None where there is no such file. Its lines may have been through a system that ends them with
/// a carriage return.
Result<FolderLocks> read_locks(const fs::path& file) {
  FolderLocks locks;
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(file));
  if (!stamp) return locks;
  BATON_ASSIGN(const std::string text, read_text_file(file, kMaxBytes));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.ends_with('\r')) line.pop_back();
    // A pattern's `#` are digits in the name of a frame.
    if (line.starts_with('#')) {
      std::from_chars(line.data() + 1, line.data() + line.size(), locks.changed_ms);
    } else if (!line.empty()) {
      locks.files.insert(line);
    }
  }
  return locks;
}

}  // namespace

fs::path lock_folder(const fs::path& folder) { return folder / ".baton-locked"; }

Status record_locks(const fs::path& folder, const std::string& job, const FolderLocks& locks,
                    const Roots& roots) {
  const fs::path file = lock_folder(folder) / job;
  std::error_code link_error;
  if (fs::is_symlink(fs::symlink_status(lock_folder(folder), link_error)))
    return Error{ErrorKind::io, lock_folder(folder).string() +
                                    ": is a link, where Baton's own folder is expected"};
  BATON_ASSIGN(const FolderLocks before, read_locks(file));
  if (locks == before) return {};
  std::error_code error;
  if (locks.files.empty()) {
    fs::remove(file, error);
    if (error) return disk_error(file, error);
    fs::remove(lock_folder(folder), error);  // where others are in it, it stays
    return {};
  }
  if (!fs::is_directory(folder, error))
    return Error{ErrorKind::io,
                 folder.string() + ": is not there, and nothing can be locked in it"};
  std::string text = fmt::format("#{}\n", locks.changed_ms);
  for (const std::string& name : locks.files) text += name + "\n";
  Status written;
  for (int i = 0; i < kMostTries; ++i) {
    written = write_file_atomic(file, as_bytes_view(text), roots);
    if (written) break;
  }
  return written;
}

Status retain_locks(const fs::path& folder, const std::string& job,
                    const std::set<std::string>& files, const Roots& roots) {
  BATON_ASSIGN(FolderLocks locks, read_locks(lock_folder(folder) / job));
  std::erase_if(locks.files, [&](const std::string& name) { return !files.contains(name); });
  return record_locks(folder, job, locks, roots);
}

Result<std::map<std::string, FolderLocks>> locks_by_job(const fs::path& folder) {
  std::map<std::string, FolderLocks> jobs;
  std::error_code error;
  fs::directory_iterator files(lock_folder(folder), error);
  if (error == std::errc::no_such_file_or_directory) return jobs;
  for (; !error && files != fs::directory_iterator(); files.increment(error)) {
    // Those that begin with a dot are being written.
    const std::string id = files->path().filename().string();
    if (id.starts_with('.')) continue;
    Result<FolderLocks> locks = read_locks(files->path());
    // Unlocked while it was looked at.
    if (std::error_code gone; !locks && !fs::exists(files->path(), gone) && !gone) continue;
    if (!locks) return Error{ErrorKind::io, locks.error().message};
    jobs[id] = std::move(*locks);
  }
  if (error && error != std::errc::no_such_file_or_directory)
    return disk_error(lock_folder(folder), error);
  return jobs;
}

Result<std::map<std::string, std::string>> locks_of_others(const fs::path& folder,
                                                           const std::string& job) {
  BATON_ASSIGN(const auto jobs, locks_by_job(folder));
  std::map<std::string, std::string> others;
  for (const auto& [id, locks] : jobs) {
    if (id == job) continue;
    for (const std::string& name : locks.files) others[name] = id;
  }
  return others;
}

}  // namespace baton
