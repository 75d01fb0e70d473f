#include "jobs/study/study_runner.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>

#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// A rendering that has a name and may be done.
struct KeyedRun {
  std::size_t cell = 0;
  int seed = 0;
  std::string key;
};

/// Marks a folder whose frames are all there.
fs::path finished_mark(const fs::path& folder) { return folder / "finished"; }

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// Names a job whatever its output folder: digest of its document. Errors: assets that cannot be
/// read.
Result<std::string> job_key(JobSpec job) {
  job.output.directory = "/";
  BATON_ASSIGN(const std::string document, make_job_document(job));
  return digest_of(document).hex();
}

/// What the measures need of a scene.
Result<std::vector<Reference>> load_references(const StudyScene& scene, const StudyFolder& folder) {
  std::array<fs::path, 2> frames;
  for (int half = 0; half < 2; ++half) {
    BATON_ASSIGN(const std::string key, job_key(scene.reference[half]));
    frames[half] = folder.frames_folder(key);
  }
  std::vector<Reference> references;
  for (const FrameNumber frame : scene.frames) {
    BATON_ASSIGN(MeasuredFrame a, read_measured_frame(frame_file(frames[0], frame)));
    BATON_ASSIGN(MeasuredFrame b, read_measured_frame(frame_file(frames[1], frame)));
    references.push_back(make_reference(std::move(a), std::move(b)));
    if (const auto fault = reference_fault(references.back())) {
      return Error{ErrorKind::corrupt,
                   fmt::format("scene '{}', frame {}: {} ({} and {})", scene.name, frame, *fault,
                               frames[0].string(), frames[1].string())};
    }
  }
  return references;
}

/// Renders those of the jobs whose frames are not kept yet, each into the folder's frames_folder of
/// its job_key.
Status render_kept(const std::vector<JobSpec>& jobs, const StudyFolder& folder, JobRunner& runner) {
  std::vector<JobSpec> missing;
  for (JobSpec job : jobs) {
    BATON_ASSIGN(const std::string key, job_key(job));
    job.output.directory = folder.frames_folder(key).string();
    const bool known = std::any_of(missing.begin(), missing.end(), [&](const JobSpec& other) {
      return other.output.directory == job.output.directory;
    });
    if (!known && !is_there(finished_mark(job.output.directory))) missing.push_back(std::move(job));
  }
  if (missing.empty()) return {};
  runner.say(fmt::format("{} pictures to render", missing.size()));
  return runner.run(missing, [&](std::size_t index, const JobSummary&) {
    return write_record(finished_mark(missing[index].output.directory), {});
  });
}

Status render_references(const Study& study, const StudyFolder& folder, JobRunner& runner) {
  std::vector<JobSpec> jobs;
  for (const StudyScene& scene : study.scenes)
    jobs.insert(jobs.end(), scene.reference.begin(), scene.reference.end());
  return render_kept(jobs, folder, runner);
}

/// Measures the frames of a finished rendering.
Result<RunRecord> measure_run(const JobSpec& job, const std::vector<FrameNumber>& frames,
                              const std::vector<Reference>& references) {
  RunRecord record;
  MeasuredFrame before;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    BATON_ASSIGN(MeasuredFrame frame,
                 read_measured_frame(frame_file(job.output.directory, frames[i])));
    FrameMeasures measures = measure_frame(frame, references[i]);
    measures.frame = frames[i];
    // Flicker is between neighbours of the sequence.
    const auto at = std::lower_bound(job.frames.begin(), job.frames.end(), frames[i]);
    if (i > 0 && *std::prev(at) == frames[i - 1])
      measures.flicker = measure_flicker(before, references[i - 1], frame, references[i]);
    record.frames.push_back(measures);
    before = std::move(frame);
  }
  return record;
}

/// The record of a finished rendering; nullopt when it must be done (again). The frames of seed 1
/// are needed for the crops.
std::optional<RunRecord> kept_record(const StudyFolder& folder, const StudyScene& scene,
                                     const std::string& key, int seed) {
  std::optional<RunRecord> record = read_record(folder.record_path(key));
  const bool shown =
      seed != 1 || is_there(frame_file(folder.frames_folder(key), scene.frames.back()));
  if (!record || record->frames.size() != scene.frames.size() || !shown) return std::nullopt;
  return record;
}

}  // namespace

void JobRunner::say(const std::string& text) { spdlog::info("{}", text); }

fs::path frame_file(const fs::path& folder, FrameNumber frame) {
  return folder / frame_file_name(kFramePattern, frame.value());
}

std::string file_slug(const std::string& name) {
  std::string result;
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    result += std::isalnum(u) != 0 ? static_cast<char>(std::tolower(u)) : '-';
  }
  return result;
}

fs::path StudyFolder::record_path(const std::string& key) const {
  return root_ / "records" / (key + ".json");
}
fs::path StudyFolder::frames_folder(const std::string& key) const { return root_ / "frames" / key; }

std::string run_key(const std::string& cell_key, int seed) {
  return fmt::format("{}-{}", cell_key, seed);
}

Result<StudyResults> run_study(const Study& study, const StudyFolder& folder, JobRunner& runner) {
  StudyResults results;
  BATON_TRY(render_references(study, folder, runner));
  for (const StudyScene& scene : study.scenes) {
    BATON_ASSIGN(std::vector<Reference> references, load_references(scene, folder));
    results.references.push_back(std::move(references));
  }

  // Take over what is done and list the rest, seed by seed: what is done when somebody stops is a
  // study with fewer seeds.
  results.runs.resize(study.cells.size());
  std::vector<std::string> cell_keys;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    BATON_ASSIGN(std::string key, job_key(study.cells[c].job));
    cell_keys.push_back(std::move(key));
    results.runs[c].resize(static_cast<std::size_t>(study.num_seeds));
  }
  std::vector<KeyedRun> runs;
  std::vector<JobSpec> jobs;
  for (int seed = 1; seed <= study.num_seeds; ++seed) {
    for (std::size_t c = 0; c < study.cells.size(); ++c) {
      const std::string key = run_key(cell_keys[c], seed);
      const StudyScene& scene = study.scene_of(c);
      if (std::optional<RunRecord> record = kept_record(folder, scene, key, seed)) {
        results.runs[c][static_cast<std::size_t>(seed - 1)] = std::move(*record);
        continue;
      }
      JobSpec job = study.cells[c].job;
      job.seed = static_cast<std::uint64_t>(seed);
      job.output.directory = folder.frames_folder(key).string();
      runs.push_back({c, seed, key});
      jobs.push_back(std::move(job));
    }
  }
  const std::size_t all = study.cells.size() * static_cast<std::size_t>(study.num_seeds);
  runner.say(fmt::format("{} of {} runs are done already", all - runs.size(), all));
  if (runs.empty()) return results;

  const auto keep = [&](std::size_t index, const JobSummary& summary) -> Status {
    const KeyedRun& run = runs[index];
    const auto scene = study.cells[run.cell].scene;
    BATON_ASSIGN(RunRecord record,
                 measure_run(jobs[index], study.scenes[scene].frames, results.references[scene]));
    record.key = run.key;
    record.counts = counts_of(summary.stats);
    record.state_bytes = summary.state_bytes;
    record.state_pixels = summary.state_pixels;
    record.frames_rendered = summary.frames_done;
    BATON_TRY(write_record(folder.record_path(run.key), record));
    std::error_code ignored;
    if (run.seed != 1) fs::remove_all(jobs[index].output.directory, ignored);
    results.runs[run.cell][static_cast<std::size_t>(run.seed - 1)] = std::move(record);
    return {};
  };
  BATON_TRY(runner.run(jobs, keep));
  return results;
}

}  // namespace baton
