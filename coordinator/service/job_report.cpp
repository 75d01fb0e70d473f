#include "coordinator/service/job_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "common/base/archive.h"
#include "common/base/legible.h"
#include "coordinator/schedule/held_states.h"
#include "coordinator/schedule/waits.h"
#include "coordinator/service/history.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// A line for each worker and cause, in the order in which each came last. Behind the first line of
/// a message stands what is to be done of its task alone.
std::vector<std::string> describe(const Scheduler::Job& job, const std::vector<Failure>& failures) {
  struct Alike {
    const Failure* last;
    std::size_t count;
  };
  std::vector<Alike> causes;
  for (const Failure& failure : failures) {
    const auto found = std::ranges::find_if(causes, [&](const Alike& alike) {
      return alike.last->worker == failure.worker &&
             first_line(alike.last->message) == first_line(failure.message);
    });
    std::size_t count = 1;
    if (found != causes.end()) {
      count += found->count;
      causes.erase(found);
    }
    causes.push_back({&failure, count});
  }
  std::vector<std::string> lines;
  for (const auto& [last, count] : causes) {
    const TaskKey& task = last->lease.task;
    if (!job.tasks.graph().find(task)) {
      lines.push_back(last->message);
      continue;
    }
    const std::string place = task_text(job, task);
    lines.push_back(fmt::format(
        "{} on {}: {}", count == 1 ? place : fmt::format("{} failures, the last {}", count, place),
        last->worker, last->message));
  }
  return lines;
}

}  // namespace

std::vector<FrameNumber> finished_frames(const Scheduler::Job& job,
                                         const std::set<FrameIndex>& besides) {
  std::vector<FrameNumber> frames;
  // Assemble tasks come first, by frame.
  for (TaskIndex task = 0; task < job.tasks.graph().num_frames(); ++task) {
    const FrameIndex frame(task);
    if (job.tasks.book().status(task) == TaskStatus::done || besides.contains(frame))
      frames.push_back(job.spec.frames[frame.index()]);
  }
  return frames;
}

JobSummary summarize(const Digest& digest, const Scheduler::Job& job) {
  const JobProgress progress = job.tasks.progress();
  JobSummary summary;
  summary.version = digest;
  summary.name = job.spec.name;
  summary.output_directory = job.spec.output.directory;
  summary.status = job.status;
  summary.priority = job.spec.priority;
  summary.tasks_total = progress.tasks_total;
  summary.tasks_done = progress.tasks_done;
  summary.tasks_leased = progress.tasks_leased;
  summary.tasks_failed = progress.tasks_failed;
  summary.attempts_lost = progress.attempts_lost;
  summary.frames_total = static_cast<std::uint32_t>(job.spec.frames.size());
  summary.frames_done = progress.frames_done;
  summary.state_bytes = progress.state_bytes;
  summary.state_pixels = progress.state_pixels;
  summary.states_held = is_open(job.status) ? held_now(job.tasks).size() : 0;
  summary.checkpoint_every = job.spec.state.checkpoint_every;
  summary.stats = job.tasks.stats();
  return summary;
}

JobDetail describe_job(const Scheduler& scheduler, const Digest& digest,
                       const std::vector<Failure>& failures) {
  const Scheduler::Job& job = *scheduler.find_job(digest);
  JobDetail detail{summarize(digest, job), finished_frames(job, {}), {}};
  detail.failures = describe(job, failures);
  for (const auto& [frame, stats] : job.tasks.frames()) {
    const FrameNumber number = job.spec.frames[frame.index()];
    detail.frames.push_back(
        {.frame = number, .sampling = stats.sampling, .quality = stats.quality});
  }
  detail.waits = waits_for(scheduler, digest, std::chrono::steady_clock::now());
  detail.lacks_room = lacks_room(scheduler, digest);
  return detail;
}

Result<Digest> choose_job(const std::vector<FoundJob>& found, const std::string& text) {
  std::vector<FoundJob> matches;
  const bool any_named = std::ranges::any_of(found, &FoundJob::is_named);
  // A name that is what people are told of the ID of another job says neither.
  if (any_named) {
    const auto other = std::ranges::find(found, false, &FoundJob::is_named);
    if (other != found.end() && other->id.hex() != text && other->job.hex() != text &&
        text.size() >= other->id.short_hex().size())
      return Error{ErrorKind::bad_input,
                   fmt::format("job '{}': a job has this name, and the ID {} begins so: expected "
                               "all digits of an ID",
                               text, other->id.hex())};
  }
  for (const FoundJob& job : found) {
    if (job.id.hex() == text || job.job.hex() == text) return job.job;
    if (job.is_named == any_named) matches.push_back(job);
  }
  std::vector<FoundJob> open = matches;
  std::erase_if(open, [](const FoundJob& job) { return !is_open(job.status); });
  if (open.size() == 1) matches = open;
  if (matches.size() == 1) return matches.front().job;
  if (matches.empty())
    return Error{ErrorKind::bad_input, fmt::format("job '{}': no job has this name or ID", text)};

  std::string list;
  for (const FoundJob& job : matches)
    list += fmt::format("\n  {}  {}", job.id.hex(), job_status_name(job.status));
  return Error{ErrorKind::bad_input,
               fmt::format("job '{}': {} jobs {}:{}", text, matches.size(),
                           any_named ? "have this name" : "have IDs that begin so", list)};
}

std::vector<std::string> lost_reasons(const LostFiles& lost) {
  std::vector<std::string> reasons;
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < lost.frames.size() && i < kMost; ++i)
    reasons.push_back(fmt::format("{} is gone, or not as it was last written", lost.frames[i]));
  if (lost.frames.size() > kMost)
    reasons.push_back(fmt::format("and {} frames more", lost.frames.size() - kMost));
  const std::size_t blobs = lost.tasks.size() - std::min(lost.tasks.size(), lost.frames.size());
  if (blobs > 0 && lost.frames.empty())
    reasons.push_back(fmt::format("{} is gone or has another size{}", lost.first,
                                  blobs > 1 ? fmt::format(", and {} blobs more", blobs - 1) : ""));
  return reasons;
}

LostFiles find_lost_files(const JobAdded& job, const BlobStore& store, const FileTable& files,
                          const LockedFrames& locked, bool restart) {
  // What is recorded as done, and which blobs that leaves.
  JobTasks recorded(job.spec);
  BlobReferences references;
  recorded.restore(job.completions, {}, references, job.plan);
  const JobGraph& graph = recorded.graph();
  LostFiles lost;
  const auto lose = [&](TaskIndex task, const fs::path& path) {
    if (lost.tasks.empty()) lost.first = path.string();
    lost.tasks.push_back(graph.key(task));
  };
  const auto is_blob_there = [&](const BlobRef& blob) {
    if (blob.is_held()) return true;  // the scheduler knows its holder
    const Result<std::optional<FileStamp>> stamp = stamp_of(store.path(blob.digest));
    if (stamp) return *stamp && (*stamp)->size_bytes == blob.size_bytes;
    if (stamp.error().kind != ErrorKind::io) return false;
    if (!lost.unreadable) lost.unreadable = stamp.error().message;
    return true;
  };
  const auto lose_if_gone = [&](TaskIndex task, const std::vector<BlobRef>& blobs) {
    const auto gone = std::find_if_not(blobs.begin(), blobs.end(), is_blob_there);
    if (gone != blobs.end()) lose(task, store.path(gone->digest));
  };

  for (TaskIndex task = graph.num_frames(); task < graph.num_tasks(); ++task) {
    lose_if_gone(task, recorded.ledger().live_blobs(recorded.view(), task));
    if (recorded.ledger().is_cut(task))
      lose_if_gone(task, recorded.ledger().inputs(recorded.view(), task));
    for (const BlobRef& blob : recorded.ledger().spare_blobs(recorded.view(), task)) {
      if (!blob.is_held() && !store.contains(blob.digest)) lost.spares.push_back(blob);
    }
  }
  for (TaskIndex frame = 0; frame < graph.num_frames(); ++frame) {
    if (recorded.book().status(frame) != TaskStatus::done) continue;
    ++lost.num_frames;
    const fs::path path = frame_path(job.spec, FrameIndex(frame));
    const bool is_locked = locked.contains(FrameIndex(frame));
    const FileVerdict verdict =
        is_locked ? judge_locked(path) : files.judge(path, recorded.made().outputs(frame).front());
    const bool is_strange =
        verdict.state == FileState::strange || (is_locked && verdict.state == FileState::absent);
    if (verdict.state == FileState::right) continue;
    if (verdict.state == FileState::unreadable && (!restart || is_locked)) {
      if (!lost.unreadable) lost.unreadable = verdict.fault;
      continue;
    }
    if (verdict.state == FileState::unknown || (is_strange && (!restart || is_locked))) {
      ++(is_strange ? lost.num_strange : lost.num_unknown);
      continue;
    }
    lose(frame, path);
    lost.frames.push_back(path.string());
  }

  // A folder that is not there is not mounted rather than empty.
  std::error_code error;
  const fs::path& folder = job.spec.output.directory;
  if (!restart && lost.num_frames > 0 && !fs::is_directory(folder, error))
    lost.unreadable = fmt::format("{}: the output folder is not there", folder.string());
  return lost;
}

Result<std::optional<JobDetail>> archived_detail(Journal& journal, const Digest& job,
                                                 const std::string& name) {
  BATON_ASSIGN(const std::optional<Bytes> bytes, journal.archived_detail(job));
  if (!bytes) return std::optional<JobDetail>();
  JobDetail detail;
  ArchiveReader reader(*bytes);
  reader(detail);
  if (reader.complete()) return std::optional(std::move(detail));
  return Error{ErrorKind::corrupt, fmt::format("the archived job {} cannot be read", name)};
}

}  // namespace baton
