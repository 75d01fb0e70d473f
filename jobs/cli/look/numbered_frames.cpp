#include "jobs/cli/look/numbered_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>

#include "common/image/image_io.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// "shot.0012.exr" as "shot.#.exr" and 12; nullopt: no EXR file with a number before its ending.
std::optional<std::pair<std::string, FrameNumber>> split_name(const std::string& name) {
  constexpr std::string_view kEnding = ".exr";
  if (!name.ends_with(kEnding)) return std::nullopt;
  const std::string stem = name.substr(0, name.size() - kEnding.size());
  const std::size_t first = stem.find_last_not_of("0123456789") + 1;
  int number = 0;
  const char* const end = stem.data() + stem.size();
  const auto read = std::from_chars(stem.data() + first, end, number);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return std::pair{stem.substr(0, first) + "#" + std::string(kEnding), FrameNumber(number)};
}

/// Every numbered EXR file of a folder, by number.
Result<std::map<FrameNumber, fs::path>> files_in(const fs::path& folder) {
  std::map<FrameNumber, fs::path> files;
  std::string pattern;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const auto split = split_name(entry.path().filename().string());
    if (!split) continue;
    if (!pattern.empty() && pattern != split->first) {
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: frames named {} and {}, expected one sequence", folder.string(),
                               std::min(pattern, split->first), std::max(pattern, split->first))};
    }
    pattern = split->first;
    files.emplace(split->second, entry.path());
  }
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", folder.string(), error.message())};
  if (files.empty())
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: no frames, such as frame.0001.exr", folder.string())};
  return files;
}

/// The rate that the header of a frame says, else 24.
Result<std::string> rate_of(const fs::path& frame) {
  BATON_ASSIGN(const ImageMetadata metadata, read_exr_metadata(frame));
  const auto found =
      std::ranges::find(metadata, "framesPerSecond", [](const auto& entry) { return entry.first; });
  if (found == metadata.end()) return std::string("24");
  const std::string& rate = found->second;
  return rate.ends_with("/1") ? rate.substr(0, rate.size() - 2) : rate;
}

Result<FrameFolder> in_folder(const fs::path& path, const std::string& range) {
  BATON_ASSIGN(const auto files, files_in(path));
  FrameFolder folder{path, {}, {}, {}};
  std::vector<FrameNumber> wanted;
  for (const auto& [number, file] : files) wanted.push_back(number);
  if (!range.empty()) {
    BATON_ASSIGN(wanted, parse_frames(range));
  }
  for (const FrameNumber number : wanted) {
    const auto found = files.find(number);
    if (found == files.end()) {
      folder.missing.push_back(number);
    } else {
      folder.frames.push_back({number, found->second});
    }
  }
  if (!folder.frames.empty()) {
    BATON_ASSIGN(folder.frames_per_second, rate_of(folder.frames.front().file));
  }
  return folder;
}

Result<FrameFolder> of_job(const fs::path& path, const std::string& range) {
  BATON_ASSIGN(JobSpec job, load_job(path));
  if (!range.empty()) {
    BATON_ASSIGN(job.frames, parse_frames(range));
  }
  FrameFolder folder{job.output.directory, {}, {}, fmt::format("{}", job.output.frames_per_second)};
  for (const FrameNumber number : job.frames) {
    const fs::path file = folder.directory / frame_file_name(job.output.pattern, number.value());
    std::error_code error;
    if (fs::is_regular_file(file, error)) {
      folder.frames.push_back({number, file});
    } else {
      folder.missing.push_back(number);
    }
  }
  return folder;
}

}  // namespace

Result<FrameFolder> find_frames(const fs::path& job_or_folder, const std::string& range) {
  std::error_code error;
  Result<FrameFolder> found = fs::is_directory(job_or_folder, error)
                                  ? in_folder(job_or_folder, range)
                                  : of_job(job_or_folder, range);
  if (found && found->frames.empty()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: none of the frames {} is there", found->directory.string(),
                             format_frames(found->missing))};
  }
  return found;
}

}  // namespace baton
