#include "common/store/frame_locks.h"

#include <fmt/format.h>

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

/// None where there is no such file.
Result<std::set<std::string>> read_names(const fs::path& file) {
  std::set<std::string> names;
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(file));
  if (!stamp) return names;
  BATON_ASSIGN(const std::string text, read_text_file(file, kMaxBytes));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) names.insert(line);
  return names;
}

}  // namespace

fs::path lock_folder(const fs::path& folder) { return folder / ".baton-locked"; }

Status record_locks(const fs::path& folder, const std::string& job,
                    const std::set<std::string>& files) {
  const fs::path file = lock_folder(folder) / job;
  BATON_ASSIGN(const std::set<std::string> before, read_names(file));
  if (files == before) return {};
  std::error_code error;
  if (files.empty()) {
    fs::remove(file, error);
    if (error) return disk_error(file, error);
    fs::remove(lock_folder(folder), error);  // where others are in it, it stays
    return {};
  }
  if (!fs::is_directory(folder, error))
    return Error{ErrorKind::io,
                 folder.string() + ": is not there, and nothing can be locked in it"};
  std::string text;
  for (const std::string& name : files) text += name + "\n";
  Status written;
  for (int i = 0; i < kMostTries; ++i) {
    written = write_file_atomic(file, as_bytes_view(text));
    if (written) break;
  }
  return written;
}

Status retain_locks(const fs::path& folder, const std::string& job,
                    const std::set<std::string>& files) {
  BATON_ASSIGN(std::set<std::string> names, read_names(lock_folder(folder) / job));
  std::erase_if(names, [&](const std::string& name) { return !files.contains(name); });
  return record_locks(folder, job, names);
}

Result<std::map<std::string, std::string>> locks_of_others(const fs::path& folder,
                                                           const std::string& job) {
  std::map<std::string, std::string> others;
  std::error_code error;
  fs::directory_iterator files(lock_folder(folder), error);
  if (error == std::errc::no_such_file_or_directory) return others;
  for (; !error && files != fs::directory_iterator(); files.increment(error)) {
    // Those that begin with a dot are being written.
    const std::string id = files->path().filename().string();
    if (id == job || id.starts_with('.')) continue;
    Result<std::set<std::string>> names = read_names(files->path());
    // Unlocked while it was looked at.
    if (std::error_code gone; !names && !fs::exists(files->path(), gone) && !gone) continue;
    if (!names) return Error{ErrorKind::io, names.error().message};
    for (const std::string& name : *names) others[name] = id;
  }
  if (error && error != std::errc::no_such_file_or_directory)
    return disk_error(lock_folder(folder), error);
  return others;
}

}  // namespace baton
