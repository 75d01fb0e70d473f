#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// Names of the frames of every job of a study.
inline constexpr const char* kFramePattern = "frame.####.exr";

/// Adds what the measures need of a job's frames and takes what would disturb them, but for AOVs.
/// All jobs see the same points of the scene, or the noise of edges would count as that of the
/// light.
void prepare_measured(JobSpec& job);
/// Brute force for some frames of such a job. half: 0 or 1, of two with seeds of their own.
JobSpec reference_job(const JobSpec& job, int samples, const std::vector<FrameNumber>& frames,
                      int half);

/// A scene of a study, with the two halves of its reference: equal jobs with different seeds, so
/// that their difference tells what the reference can resolve.
struct StudyScene {
  std::string name;
  std::array<JobSpec, 2> reference;  ///< the measured frames alone
  std::vector<FrameNumber> frames;   ///< measured
  /// A measured frame at which the light changes at once; 0: none.
  FrameNumber cut_frame{};
  /// Place (x, y), width and height in pixels, shown side by side.
  std::array<int, 4> crop{};
};

/// One combination: everything but the seed.
struct StudyCell {
  std::size_t scene = 0, method = 0;  ///< indices into the study's lists
  std::string budget;
  /// Its seed and output folder are filled in for each rendering.
  JobSpec job;
  /// What `auto` chose for it, "CHOICE: what is expected of it"; empty: its job was fixed.
  std::string chosen{};
};

/// What `baton chart` renders: every cell with num_seeds seeds, 1, 2, ...
struct Study {
  std::string name;
  int num_seeds = 20;
  std::vector<StudyScene> scenes;
  std::vector<std::string> methods;
  /// By scene, then method, then budget, in the order of the file.
  std::vector<StudyCell> cells;

  const StudyScene& scene_of(std::size_t cell) const { return scenes[cells[cell].scene]; }
  const std::string& method_of(std::size_t cell) const { return methods[cells[cell].method]; }
};

/// The study of a JSON text, every combination checked as a job. name goes first in every error
/// line (usually the file); relative paths are taken relative to base_directory. One Error lists
/// every fault with its JSON path in the study, also those inside of patches:
/// `study.json: $.methods[1].patch.sampling.metod: unknown key`. Grammar: jobs/study/STUDY.md.
Result<Study> parse_study(std::string_view json, const std::string& name,
                          const std::filesystem::path& base_directory);

/// Reads and parses a study file.
Result<Study> load_study(const std::filesystem::path& path);

}  // namespace baton
