#include "common/store/frame_locks.h"

#include <fmt/format.h>

#include <optional>
#include <sstream>

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

}  // namespace

std::filesystem::path lock_file(const std::filesystem::path& folder) {
  return folder / ".baton-locked";
}

Status record_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files) {
  const std::filesystem::path file = lock_file(folder);
  BATON_ASSIGN(Locks locks, read_locks(file));
  const Locks before = locks;
  locks.erase(job);
  if (!files.empty()) locks[job] = files;
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
