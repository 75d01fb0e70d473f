#include "coordinator/service/job_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

namespace baton {
namespace {

namespace fs = std::filesystem;

/// The frames that are finished, by user's number. Assemble tasks come first, by frame.
std::vector<std::int32_t> finished_frames(const Scheduler::Job& job) {
  std::vector<std::int32_t> frames;
  for (TaskIndex frame = 0; frame < job.tasks.graph().num_frames(); ++frame) {
    if (job.tasks.status(frame) == TaskStatus::done) {
      frames.push_back(job.spec.frames[static_cast<std::size_t>(frame)]);
    }
  }
  return frames;
}

std::string describe(const Scheduler::Job& job, const Failure& failure) {
  const TaskKey& task = failure.lease.task;
  const JobGraph& graph = job.tasks.graph();
  const auto number = [&](std::int32_t frame) {
    return job.spec.frames[static_cast<std::size_t>(frame)];
  };
  if (!graph.find(task)) return failure.message;
  const std::string place =
      task.kind == TaskKind::assemble ? fmt::format("frame {}", number(task.step))
      : task.kind == TaskKind::second_pass
          ? fmt::format("frame {}, tile {}, second pass", number(task.step), task.tile)
          : fmt::format("frames {}-{}, tile {}", number(graph.first_frame(task.step)),
                        number(graph.last_frame(task.step)), task.tile);
  return fmt::format("{} on {}: {}", place, failure.worker, failure.message);
}

}  // namespace

JobSummary summarize(const Digest& digest, const Scheduler::Job& job) {
  const JobProgress& progress = job.tasks.progress();
  JobSummary summary;
  summary.job = digest;
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
  summary.stats = progress.stats;
  return summary;
}

JobDetail describe_job(const Scheduler& scheduler, const Digest& digest,
                       const std::vector<Failure>& failures) {
  const Scheduler::Job& job = *scheduler.find_job(digest);
  JobDetail detail{summarize(digest, job), finished_frames(job), {}};
  for (const Failure& failure : failures) detail.failures.push_back(describe(job, failure));
  for (const auto& [frame, stats] : job.tasks.progress().frames) {
    detail.frames.push_back(stats);
    detail.frames.back().frame = job.spec.frames[static_cast<std::size_t>(frame)];
    detail.frames.back().tile = -1;
  }
  detail.waits = scheduler.waits_for(digest, std::chrono::steady_clock::now());
  return detail;
}

Result<Digest> resolve_job(const Scheduler& scheduler, const std::string& text) {
  std::vector<Digest> named, begin_so;
  for (const Digest& job : scheduler.jobs()) {
    if (job.hex() == text) return job;
    if (scheduler.find_job(job)->spec.name == text) named.push_back(job);
    if (!text.empty() && job.hex().starts_with(text)) begin_so.push_back(job);
  }
  const std::vector<Digest>& matches = named.empty() ? begin_so : named;
  if (matches.size() == 1) return matches.front();
  if (matches.empty())
    return Error{ErrorKind::bad_input, fmt::format("job '{}': no job has this name or ID", text)};

  std::string list;
  for (const Digest& job : matches) {
    list += fmt::format("\n  {}  {}", job.hex(), job_status_name(scheduler.find_job(job)->status));
  }
  return Error{ErrorKind::bad_input,
               fmt::format("job '{}': {} jobs {}:{}", text, matches.size(),
                           named.empty() ? "have IDs that begin so" : "have this name", list)};
}

std::vector<TaskKey> replaced_frames(const Scheduler::Job& rival, const JobSpec& job) {
  std::vector<TaskKey> replaced;
  if (fs::path(rival.spec.output.directory).lexically_normal() !=
      fs::path(job.output.directory).lexically_normal())
    return replaced;
  std::set<std::string> names;
  for (const int frame : job.frames) names.insert(frame_file_name(job.output.pattern, frame));
  for (TaskIndex frame = 0; frame < rival.tasks.graph().num_frames(); ++frame) {
    const bool is_there = rival.tasks.status(frame) == TaskStatus::done;
    const int number = rival.spec.frames[static_cast<std::size_t>(frame)];
    if ((is_there || is_open(rival.status)) &&
        names.contains(frame_file_name(rival.spec.output.pattern, number)))
      replaced.push_back(rival.tasks.graph().key(frame));
  }
  return replaced;
}

LostFiles find_lost_files(const JobAdded& job, const BlobStore& store) {
  // What is recorded as done, and which blobs that leaves.
  JobTasks recorded(job.spec);
  BlobReferences references;
  recorded.restore(job.completions, {}, references);
  const JobGraph& graph = recorded.graph();
  LostFiles lost;
  const auto look = [&](TaskIndex task, const fs::path& path, std::uint64_t size_bytes) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (!error && size == size_bytes) return true;
    if (error && error != std::errc::no_such_file_or_directory) {
      if (!lost.unreadable) lost.unreadable = fmt::format("{}: {}", path.string(), error.message());
      return true;
    }
    if (lost.tasks.empty()) lost.first = path.string();
    lost.tasks.push_back(graph.key(task));
    return false;
  };

  for (TaskIndex task = graph.num_frames(); task < graph.num_tasks(); ++task) {
    for (const BlobRef& blob : recorded.live_blobs(task)) {
      if (!look(task, store.path(blob.digest), blob.size_bytes)) break;
    }
    for (const BlobRef& blob : recorded.spare_blobs(task)) {
      if (!store.contains(blob.digest)) lost.spares.push_back(graph.key(task));
    }
  }
  for (TaskIndex frame = 0; frame < graph.num_frames(); ++frame) {
    if (recorded.status(frame) != TaskStatus::done) continue;
    look(frame, frame_path(job.spec, frame), recorded.outputs(frame).front().size_bytes);
  }

  // A folder that is not there is not mounted rather than empty.
  std::error_code error;
  const fs::path& folder = job.spec.output.directory;
  const bool any_frame = recorded.progress().frames_done > 0;
  if (any_frame && !fs::is_directory(folder, error) && !lost.unreadable)
    lost.unreadable = fmt::format("{}: the output folder is not there", folder.string());
  return lost;
}

}  // namespace baton
