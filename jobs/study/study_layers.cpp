#include "jobs/study/study_layers.h"

#include <sstream>

#include "common/job/text/job_json.h"
#include "common/job/text/job_json_text.h"

namespace baton {
namespace {

using nlohmann::json;

/// True when `path` is `prefix` or lies below it.
bool lies_in(const std::string& path, const std::string& prefix) {
  return path.starts_with(prefix) &&
         (path.size() == prefix.size() ||
          std::string_view(".[").find(path[prefix.size()]) != std::string_view::npos);
}

/// Length of the longest path of `patch` that leads to `target`; 1 when it says nothing of it.
std::size_t depth_of(const json& patch, const std::string& path, const std::string& target) {
  if (!lies_in(target, path)) return 0;
  std::size_t depth = path.size();
  if (patch.is_object()) {
    for (const auto& [key, value] : patch.items())
      depth = std::max(depth, depth_of(value, json_path_key(path, key), target));
  }
  return depth;
}

/// The path in the study that says the value at `job_path` of the job ("$..." ).
std::string study_path(const std::string& job_path, const std::string& base_path,
                       const std::vector<StudyPatch>& patches) {
  const StudyPatch* best = nullptr;
  std::size_t best_depth = 1;
  for (const StudyPatch& patch : patches) {
    const std::size_t depth = depth_of(patch.value, "$", job_path);
    if (depth < best_depth || depth <= 1) continue;
    best = &patch;
    best_depth = depth;
  }
  return best != nullptr ? best->path + job_path.substr(1) : base_path;
}

}  // namespace

std::optional<JobSpec> patched_job(const json& base, const std::string& base_path,
                                   const std::vector<StudyPatch>& patches,
                                   const std::filesystem::path& base_directory,
                                   StudyFaults& faults) {
  json merged = base;
  for (const StudyPatch& patch : patches) merged.merge_patch(patch.value);
  Result<JobSpec> job = parse_job(merged.dump(), "", base_directory);
  if (job) return std::move(job).value();

  // Each line is ": $.path: message".
  std::istringstream lines(job.error().message);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find('$');
    const std::size_t end = line.find(": ", begin);
    if (begin == std::string::npos || end == std::string::npos) {
      faults.add(base_path, line);
      continue;
    }
    const std::string path = line.substr(begin, end - begin);
    const std::string place = study_path(path, base_path, patches);
    // What no patch says is the job's own: its path in the job goes with it.
    const std::string message = line.substr(place == base_path ? begin : end + 2);
    faults.add(place, message);
  }
  return std::nullopt;
}

}  // namespace baton
