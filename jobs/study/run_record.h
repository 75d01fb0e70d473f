#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/task.h"
#include "jobs/study/measures.h"

namespace baton {

/// What is kept of one run: one cell with one seed.
struct RunRecord {
  std::string key;  ///< names the run whatever the study: see run_key
  RenderStats stats;
  std::uint64_t state_bytes = 0, state_pixels = 0;
  std::uint64_t frames_rendered = 0;
  std::vector<FrameMeasures> frames;
};

/// Publishes the record as JSON.
Status write_record(const std::filesystem::path& path, const RunRecord& record);
/// nullopt when there is none that can be read whole: the run is then done again.
std::optional<RunRecord> read_record(const std::filesystem::path& path);

}  // namespace baton
