#include "common/store/frame_locks.h"

#include <fmt/format.h>

#include <optional>
#include <sstream>
#include <utility>

#include "common/base/file_stamp.h"
#include "common/base/files.h"

namespace baton {
namespace {

/// Files by job.
using Locks = std::map<std::string, std::set<std::string>>;
constexpr std::uint64_t kMaxBytes = 64 << 20;
constexpr std::size_t kIdLength = 16;

/// None where there is no such file.
Result<Locks> read_locks(const std::filesystem::path& file) {
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(file));
  Locks locks;
  if (!stamp) return locks;
  BATON_ASSIGN(const std::string text, read_text_file(file, kMaxBytes));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() <= kIdLength + 1 || line[kIdLength] != ' ') {
      return Error{ErrorKind::corrupt,
                   fmt::format("{}: expected lines of a job's ID and the name of a frame that it "
                               "has locked: mend it, or remove it, and nothing is locked by others",
                               file.string())};
    }
    locks[line.substr(0, kIdLength)].insert(line.substr(kIdLength + 1));
  }
  return locks;
}

Status write_locks(const std::filesystem::path& file, const Locks& before, Locks locks) {
  std::erase_if(locks, [](const auto& of_job) { return of_job.second.empty(); });
  if (locks == before) return {};
  std::string text;
  for (const auto& [id, names] : locks) {
    for (const std::string& name : names) text += fmt::format("{} {}\n", id, name);
  }
  if (!text.empty()) return write_file_atomic(file, as_bytes_view(text));
  std::error_code error;
  std::filesystem::remove(file, error);
  if (!error) return {};
  return Error{ErrorKind::io, fmt::format("{}: {}", file.string(), error.message())};
}

}  // namespace

std::filesystem::path lock_file(const std::filesystem::path& folder) {
  return folder / ".baton-locked";
}

Status record_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files) {
  BATON_ASSIGN(const Locks before, read_locks(lock_file(folder)));
  Locks locks = before;
  locks[job] = files;
  return write_locks(lock_file(folder), before, std::move(locks));
}

Status retain_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files) {
  BATON_ASSIGN(const Locks before, read_locks(lock_file(folder)));
  Locks locks = before;
  std::erase_if(locks[job], [&](const std::string& file) { return !files.contains(file); });
  return write_locks(lock_file(folder), before, std::move(locks));
}

Result<std::map<std::string, std::string>> locks_of_others(const std::filesystem::path& folder,
                                                           const std::string& job) {
  BATON_ASSIGN(const Locks locks, read_locks(lock_file(folder)));
  std::map<std::string, std::string> others;
  for (const auto& [id, files] : locks) {
    if (id == job) continue;
    for (const std::string& file : files) others[file] = id;
  }
  return others;
}

}  // namespace baton
