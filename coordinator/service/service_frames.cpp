#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/job/plan/sequence.h"
#include "coordinator/service/frame_inspection.h"
#include "coordinator/service/service.h"
#include "coordinator/service/submission.h"

namespace baton {
namespace {

constexpr std::chrono::milliseconds kInspectAgain{500};
/// Who waits for a file asks again within this.
constexpr std::chrono::milliseconds kForgetUnreadable{5000};

}  // namespace

/// A worker has found a whole picture in the place of a frame. What jobs of the folder have left
/// there it may replace; anybody else's stays, and the end of the job tells of it.
Status Service::judge_place(const std::string& worker, const LeaseReturn& message) {
  const LeaseId& lease = message.lease;
  const Scheduler::Job* const job = farm_.scheduler.find_job(lease.job);
  const bool is_frame = job != nullptr && lease.task.kind == TaskKind::assemble &&
                        job->tasks.graph().find(lease.task);
  if (!is_frame) return farm_.step(LeaseReturned{worker, lease});
  const std::filesystem::path path = frame_path(job->spec, lease.task.frame());
  BATON_ASSIGN(const bool may_go,
               farm_.may_replace(lease.job, path,
                                 {FileState::strange, {}, message.in_place, message.writer}));
  if (!may_go)
    tell(fmt::format("job {}: {} is another picture, and stays", farm_.history.name_of(lease.job),
                     path.string()));
  return farm_.step(PlaceTaken{worker, lease, !may_go});
}

/// Remembers how the frame of an accepted report stands: as long as it stands so, it needs no
/// reading. One that has changed since it was written is read before the job is done.
Status Service::keep_frame_file(const TaskDone& report, const ReportedFrame& frame) {
  const Scheduler::Job* const job = farm_.scheduler.find_job(report.lease.job);
  const auto task = job ? job->tasks.graph().find(report.lease.task) : std::nullopt;
  if (!task || job->tasks.made().outputs(*task) != report.made.outputs) return {};
  const FileStamp stamp = frame.is_as_written ? report.frame : FileStamp();
  if (frame.is_as_written) {
    files_.add({frame.path, stamp, frame.digest, {}, report.lease.job.hex()});
  } else {
    files_.forget(frame.path);
  }
  const JobId id = farm_.history.jobs().of(report.lease.job).id;
  const std::string name = frame.path.filename().string();
  BATON_ASSIGN(const auto given_up, farm_.journal.given_up(id));
  if (given_up.contains(name))
    BATON_TRY(farm_.take_back(id, [&](const std::string& file) { return file == name; }));
  return farm_.journal.record_frame_file(report.lease.job, report.lease.task.frame(),
                                         FrameFile{frame.digest, stamp, 1});
}

/// A job whose output folder is another one than that which was marked is paused: what is missing
/// there is not gone. Returns whether the folder is another one.
Result<bool> Service::watch_folder(const Digest& job) {
  const Scheduler::Job* const known = farm_.scheduler.find_job(job);
  const std::optional<std::string> fault =
      known == nullptr ? std::nullopt : farm_.lost_mark(job, known->spec);
  if (fault) BATON_TRY(farm_.step(JobPaused{job, "its output folder: " + *fault}));
  return fault.has_value();
}

/// Has the frames of jobs read that may be done; a full queue has room later.
void Service::start_inspections() {
  const TimePoint now = std::chrono::steady_clock::now();
  std::erase_if(farm_.to_inspect, [&](const auto& wanted) {
    const auto& [digest, due] = wanted;
    const Scheduler::Job* const job = farm_.scheduler.find_job(digest);
    return job == nullptr || job->status != JobStatus::running ||
           (due <= now &&
            waits_->inspect({digest},
                            files_to_inspect(*job, files_, farm_.locked(digest, job->spec))));
  });
}

/// Whether a frame of the job that cannot be read is waited for: not for longer than file_patience,
/// since it was last seen to be readable or nobody looked for so long.
bool Service::may_pass(const Digest& job) {
  const TimePoint now = std::chrono::steady_clock::now();
  const auto [known, is_new] = unreadable_.try_emplace(job, Unreadable{now, now});
  Unreadable& frame = known->second;
  if (now - frame.seen > std::max(farm_.options.file_patience, kForgetUnreadable))
    frame.since = now;
  frame.seen = now;
  if (now - frame.since < farm_.options.file_patience) return true;
  unreadable_.erase(job);
  return false;
}

/// Only here is a job done. One whose frames are read while it runs gets back what it lacks.
Status Service::end_inspection(const FilesRead& read) {
  const Digest digest = std::get<InspectionOf>(read.reason).job;
  const Scheduler::Job* const job = farm_.scheduler.find_job(digest);
  if (job == nullptr || job->status != JobStatus::running) return {};
  BATON_ASSIGN(const InspectedFrames found,
               inspect_frames(*job, read.contents, farm_.locked(digest, job->spec), farm_.journal,
                              farm_.history.jobs(), digest));
  // What changes while it is read, or cannot be read now, may stand otherwise in a moment.
  if (found.is_stale || (!found.unreadable.empty() && may_pass(digest))) {
    farm_.to_inspect.emplace(digest, std::chrono::steady_clock::now() + kInspectAgain);
    return {};
  }
  pass(digest);

  // What is missing in another folder is not gone.
  BATON_ASSIGN(const bool is_elsewhere, found.all_right() ? false : watch_folder(digest));
  if (is_elsewhere) return {};
  std::error_code error;
  const std::filesystem::path& folder = job->spec.output.directory;
  if (!found.lost.empty() && !std::filesystem::is_directory(folder, error))
    return farm_.step(
        JobPaused{digest, fmt::format("{}: the output folder is not there", folder.string())});

  for (const std::string& file : found.lost_files)
    spdlog::warn("job {}: {} is gone, or not as it was last written, and is made again",
                 farm_.history.name_of(digest), file);
  if (!found.unreadable.empty()) {
    // The others are made again once it goes on.
    if (!found.lost.empty()) BATON_TRY(farm_.step(FramesInspected{digest, found.lost}));
    return farm_.step(JobPaused{digest, "a frame that can be read: " + found.unreadable});
  }
  if (found.lost.empty() && job->tasks.book().counts().open > 0) return {};
  const TaskCounts& tasks = job->tasks.book().counts();
  if (found.lost.empty() && found.doubt.empty() && tasks.failed == 0) {
    farm_.history.set_actor({});
    return Submission(farm_, files_, speaker_).finish(digest);
  }
  return farm_.step(FramesInspected{digest, found.lost,
                                    doubt_text(found.doubt, farm_.history.jobs().of(digest).id)});
}

}  // namespace baton
