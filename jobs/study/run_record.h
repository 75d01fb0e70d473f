#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/task.h"
#include "jobs/study/measures.h"

namespace baton {

/// Counted work and CPU seconds of a rendering, over all its frames.
struct RunCounts {
  std::uint64_t pixels = 0, pixels_background = 0;
  std::uint64_t rays_shadow = 0;  ///< in both passes
  std::uint64_t target_evaluations = 0, moves_proposed = 0;
  std::uint64_t pixels_resampled = 0, pixels_restarted = 0;
  double cpu_seconds = 0;
  double seconds_light = 0, seconds_primary = 0, seconds_sample = 0, seconds_visibility = 0,
         seconds_shade = 0, seconds_second_pass = 0;

  bool operator==(const RunCounts&) const = default;
  std::uint64_t lit_pixels() const { return pixels - pixels_background; }
};
RunCounts counts_of(const RenderStats& stats);

/// What is kept of one rendering: one cell with one seed.
struct RunRecord {
  /// Names the rendering whatever the study: see run_key.
  std::string key;
  RunCounts counts;
  std::uint64_t state_bytes = 0, state_pixels = 0;
  std::uint64_t frames_rendered = 0;
  std::vector<FrameMeasures> frames;
};

/// Publishes the record as JSON.
Status write_record(const std::filesystem::path& path, const RunRecord& record);
/// nullopt when there is none that can be read whole: the rendering is then done again.
std::optional<RunRecord> read_record(const std::filesystem::path& path);

}  // namespace baton
