// Jobs that grow: how many sweeps there are, and whether there are more.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>

#include "common/base/limits.h"
#include "common/base/utc.h"
#include "common/job/plan/next_sweeps.h"
#include "common/job/plan/sequence.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/submission.h"

namespace baton {

/// A frame that is not there, or is locked and nobody's, has none.
Result<Submission::WrittenSweeps> Submission::written_sweeps(const ParsedJobDocument& document) {
  std::map<FrameNumber, int> of_frames;
  for (const FrameNumber frame : document.job.frames) of_frames[frame] = 0;
  BATON_ASSIGN(const auto* neighbours, jobs_in(document.job.output.directory));
  for (const auto& [digest, former] : *neighbours) {
    if (former.document.picture != document.picture) continue;
    const JobSpec& job = former.document.job;
    for (const Completions::Task& task : former.tasks) {
      if (task.task.kind != TaskKind::assemble || task.outputs.size() != 1) continue;
      const auto frame = of_frames.find(job.frames.at(task.task.frame().index()));
      const bool has_more = frame != of_frames.end() && job.quality.sweeps > frame->second;
      if (!has_more || task.outputs.front().is_placeholder()) continue;
      const FileState state =
          files_.judge(frame_path(job, task.task.frame()), task.outputs.front()).state;
      if (state != FileState::absent) frame->second = job.quality.sweeps;
    }
  }
  WrittenSweeps sweeps{0, document.job.frames.empty() ? 0 : of_frames.begin()->second};
  for (const auto& [frame, count] : of_frames) {
    sweeps.most = std::max(sweeps.most, count);
    sweeps.common = std::min(sweeps.common, count);
  }
  return sweeps;
}

Result<std::string> Submission::with_written_sweeps(const ParsedJobDocument& document,
                                                    const std::string& text, bool restart) {
  const QualitySpec& quality = document.job.quality;
  if (!quality.may_grow()) return text;
  int sweeps = 0;
  if (!restart) {
    BATON_ASSIGN(const WrittenSweeps written, written_sweeps(document));
    sweeps = written.most;
    // What it has decided to add it goes on with.
    BATON_ASSIGN(const JobId id, known_job(document));
    const std::vector<Digest> versions = farm_.history.jobs().versions(id);
    const Scheduler::Job* const open =
        versions.empty() ? nullptr : farm_.scheduler.find_job(versions.back());
    if (open != nullptr && is_open(open->status)) {
      QualitySpec as_before = open->spec.quality;
      as_before.sweeps = quality.sweeps;
      as_before.refinable = quality.refinable;
      if (as_before == quality) sweeps = std::max(sweeps, open->spec.quality.sweeps);
    }
  }
  BATON_ASSIGN(ParsedJobDocument as_written, parse_job_document(text));
  return with_sweeps(std::move(as_written), std::max(sweeps, quality.sweeps));
}

/// A person submits it: its time and the number of its sweeps count from now on. What was decided
/// before is forgotten.
Status Submission::begin_growth(const ParsedJobDocument& document, bool restart) {
  const JobId id = farm_.history.jobs().of(document.digest).id;
  if (!document.job.quality.may_grow()) return farm_.journal.record_growth(id, {});
  BATON_ASSIGN(const WrittenSweeps written,
               restart ? Result<WrittenSweeps>(WrittenSweeps()) : written_sweeps(document));
  return farm_.journal.record_growth(id, {now_ms(), written.common, {}});
}

/// Whether a job of which all frames are there gets more sweeps, which are a new version of it.
Result<bool> Submission::grow(const Digest& version) {
  const Scheduler::Job& job = *farm_.scheduler.find_job(version);
  const QualitySpec& quality = job.spec.quality;
  if (!quality.may_grow()) return false;
  const JobId id = farm_.history.jobs().of(version).id;
  BATON_ASSIGN(JobGrowth growth, farm_.journal.growth(id));

  // By its noisiest frame; what is locked never becomes cleaner.
  const LockedFrames locked = farm_.locked(version, job.spec);
  float noise = 0;
  for (const auto& [frame, stats] : job.tasks.frames()) {
    if (!locked.contains(frame)) noise = std::max(noise, stats.quality.cycles_noise);
  }
  const bool is_one_round = quality.rounds * quality.sweeps == 1;
  const bool is_blind = quality.noise_threshold && noise == 0 && !is_one_round;
  const double seconds = static_cast<double>(now_ms() - growth.since_ms) / 1000;
  const int next = is_blind
                       ? quality.sweeps
                       : next_sweeps(quality, noise, seconds, quality.sweeps - growth.first_sweeps);
  std::string said = is_blind ? std::string("no frame tells its noise here: no more rounds")
                     : is_one_round
                         ? std::string("1 round, which does not tell its noise")
                         : fmt::format("{} rounds: noise {:.3g} as Cycles measures it",
                                       std::int64_t{quality.rounds} * quality.sweeps, noise);
  bool grows = next > quality.sweeps;
  if (grows) {
    const std::string more =
        fmt::format("{}; {} more", said, std::int64_t{next - quality.sweeps} * quality.rounds);
    const Speaker owner{Role::user, farm_.owner_of(version)};
    const Status begun = Submission(farm_, files_, owner).add_sweeps(version, next, more);
    if (!begun && begun.error().kind != ErrorKind::bad_input &&
        begun.error().kind != ErrorKind::usage)
      return begun.error();
    grows = begun.ok();
    said = grows ? more : fmt::format("{}; no more: {}", said, begun.error().message);
  }
  spdlog::info("job {}: {}", farm_.history.name_of(version), said);
  growth.said.push_back(std::move(said));
  BATON_TRY(farm_.journal.record_growth(id, growth));
  return grows;
}

/// Errors (bad_input, usage): something stands in the way; the version stays as it is.
Status Submission::add_sweeps(const Digest& version, int sweeps, const std::string& reason) {
  BATON_ASSIGN(const std::optional<std::string> before, farm_.journal.document(version));
  BATON_ASSIGN(ParsedJobDocument former, parse_job_document(before.value_or("")));
  const std::string text = with_sweeps(std::move(former), sweeps);
  BATON_ASSIGN(const ParsedJobDocument document, parse_farm_document(text));
  if (const std::int64_t count = count_tasks(document.job); count > limits::kMaxTasksPerJob)
    return Error{ErrorKind::bad_input, fmt::format("{} sweeps have {} tasks, at most {}", sweeps,
                                                   count, limits::kMaxTasksPerJob)};
  const JobId id = farm_.history.jobs().of(version).id;
  BATON_ASSIGN(const std::vector<Neighbour> others, find_neighbours(document, id, false));
  BATON_TRY(farm_.history.submitted(document.digest, id, reason));
  BATON_ASSIGN(std::vector<std::string> reasons, make_way(document, others));
  return begin({}, document, SubmitJob{text, false, /*keep_priority=*/true}, std::move(reasons));
}

}  // namespace baton
