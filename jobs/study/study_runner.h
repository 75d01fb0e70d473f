#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "jobs/study/run_record.h"
#include "jobs/study/study.h"

namespace baton {

/// Renders jobs; the command line does it with a farm.
class JobRunner {
 public:
  virtual ~JobRunner() = default;
  /// Renders all jobs, in any order, and calls `done` on this thread as each is finished. The first
  /// error of a job or of `done` ends everything.
  virtual Status run(const std::vector<JobSpec>& jobs,
                     const std::function<Status(std::size_t index, const JobSummary&)>& done) = 0;
  /// Tells a person how the study goes on.
  virtual void say(const std::string& text);
};

/// Everything that a study measured.
struct StudyResults {
  /// By cell and seed less 1.
  std::vector<std::vector<RunRecord>> runs;
  /// By scene and position in StudyScene::frames.
  std::vector<std::vector<Reference>> references;
};

/// Where the renderings of a study are kept; what a second start finds.
class StudyFolder {
 public:
  explicit StudyFolder(std::filesystem::path root) : root_(std::move(root)) {}

  std::filesystem::path record_path(const std::string& key) const;
  std::filesystem::path frames_folder(const std::string& key) const;
  std::filesystem::path farm_folder() const { return root_ / "farm"; }

 private:
  std::filesystem::path root_;
};

/// The file of a frame in a folder of frames.
std::filesystem::path frame_file(const std::filesystem::path& folder, FrameNumber frame);
/// For file names: lower case, nothing but letters, digits and '-'.
std::string file_slug(const std::string& name);

/// Names a rendering of a cell; cell_key: digest of its job, whatever the output folder. seed
/// counts from 1.
std::string run_key(const std::string& cell_key, int seed);

/// Renders what is not yet done: references first, then cells and seeds; measures each rendering
/// when its frames are there and keeps the record. The frames of seed 1 stay, for the crops. Errors
/// name the scene, method, budget and seed that failed.
Result<StudyResults> run_study(const Study& study, const StudyFolder& folder, JobRunner& runner);

}  // namespace baton
