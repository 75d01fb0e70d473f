#include "jobs/cli/farm/worker_log_reader.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "jobs/cli/text.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// "2026-11-28T13:20:46.123+01:00 baton-worker warning: text" (common/base/log.h).
std::optional<WorkerLogLine> parse_line(const std::string& line) {
  constexpr std::size_t kSeconds = 19, kMillis = 23, kZone = 29;
  if (line.size() <= kZone || line[kSeconds] != '.' || line[kZone] != ' ') return std::nullopt;
  const Result<std::int64_t> seconds = parse_since(line.substr(0, kSeconds), 0);
  const std::string zone = line.substr(kMillis, kZone - kMillis);
  const auto digits = [&](std::size_t at, std::size_t count) {
    std::int64_t value = 0;
    for (std::size_t i = at; i < at + count; ++i) value = 10 * value + (line[i] - '0');
    return value;
  };
  const std::size_t level = line.find(' ', kZone + 1), text = line.find(": ", kZone);
  if (!seconds || (zone[0] != '+' && zone[0] != '-') || text == std::string::npos || level > text)
    return std::nullopt;
  const std::int64_t minutes = 60 * digits(kMillis + 1, 2) + digits(kMillis + 4, 2);
  WorkerLogLine parsed;
  parsed.time_ms = *seconds + digits(kSeconds + 1, 3) + (zone[0] == '-' ? 1 : -1) * minutes * 60000;
  parsed.level = line.substr(level + 1, text - level - 1);
  parsed.text = line.substr(text + 2);
  return parsed;
}

}  // namespace

bool WorkerLogReader::is_there() const {
  std::error_code error;
  return fs::is_directory(folder_, error);
}

void WorkerLogReader::read_file(const fs::path& file, std::vector<WorkerLogLine>& lines) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return;
  std::uint64_t& read = read_bytes_[status.st_ino];
  if (static_cast<std::uint64_t>(status.st_size) < read) read = 0;
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(read));
  const std::string name = file.filename().string();
  bool is_wanted = false;
  // A line whose end has not come yet is read the next time.
  for (std::string line; std::getline(stream, line) && !stream.eof();) {
    read += line.size() + 1;
    if (line.starts_with("  ")) {
      if (is_wanted) lines.back().text += "\n" + line;
      continue;
    }
    std::optional<WorkerLogLine> parsed = parse_line(line);
    is_wanted = parsed && parsed->text.starts_with(wanted_);
    if (!is_wanted) continue;
    parsed->worker = name.substr(0, name.find('.'));
    lines.push_back(std::move(*parsed));
  }
}

std::vector<WorkerLogLine> WorkerLogReader::read() {
  std::vector<WorkerLogLine> lines;
  std::error_code error;
  for (fs::directory_iterator next(folder_, error), end; !error && next != end;
       next.increment(error)) {
    if (next->path().extension() == ".log") read_file(next->path(), lines);
  }
  std::ranges::stable_sort(lines, {}, &WorkerLogLine::time_ms);
  return lines;
}

}  // namespace baton
