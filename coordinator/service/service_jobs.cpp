#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <set>
#include <thread>
#include <utility>

#include "common/base/archive.h"
#include "common/base/limits.h"
#include "common/base/size_text.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "coordinator/service/answers.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/lock_keeper.h"
#include "coordinator/service/permissions.h"
#include "coordinator/service/plan_text.h"
#include "coordinator/service/questions.h"
#include "coordinator/service/service.h"
#include "coordinator/service/submission.h"

namespace baton {
namespace {

void tell_lost(const std::string& job, const LostFiles& lost) {
  if (lost.tasks.empty()) return;
  spdlog::warn("job {}: {} is gone or has another size{}", job, lost.first,
               lost.tasks.size() > 1
                   ? fmt::format(", and something of {} more tasks", lost.tasks.size() - 1)
                   : "");
}

}  // namespace

// ---- taking up the journal ----------------------------------------------------------------------

Status Service::restore_jobs() {
  BATON_ASSIGN(farm_.owners, farm_.journal.owners());
  BATON_TRY(farm_.history.read());
  BATON_TRY(farm_.take_up_marks());
  BATON_ASSIGN(const std::vector<Digest> jobs, farm_.journal.jobs());
  patient_until_ = std::chrono::steady_clock::now() + farm_.options.file_patience;
  for (const Digest& job : jobs) BATON_TRY(restore_job(job));
  for (const JobId& id : farm_.history.jobs().with_locks()) {
    // A folder may have been away when frames in it were locked or unlocked.
    const Digest newest = farm_.history.jobs().versions(id).back();
    BATON_ASSIGN(const SharedDocument document, journalled_document(farm_.journal, newest));
    if (!document->parsed) continue;
    BATON_TRY(LockKeeper(farm_).settle(document->parsed->job));
    BATON_TRY(LockKeeper(farm_).tell_again(document->parsed->job, id));
  }
  BATON_TRY(farm_.archive_ended(files_));
  BATON_TRY(farm_.count_kept());
  BATON_TRY(farm_.journal.commit());
  BATON_TRY(farm_.let_out());
  return clean_up();
}

/// Removes what processes that died left in the store and neither an open job nor the archive
/// needs. A job that cannot be read may need anything.
Status Service::clean_up() {
  next_clean_up_ = std::chrono::steady_clock::now() + farm_.options.clean_up_every;
  const std::size_t unfinished = farm_.store.clean_up();
  if (unfinished > 0)
    spdlog::info("{} files that were never finished are removed from the store", unfinished);
  BATON_TRY(farm_.history.clean_up());
  if (has_unread_jobs_) return {};
  std::size_t count = 0;
  std::uint64_t bytes = 0;
  for (const BlobStore::Leftover& blob : farm_.store.old_blobs()) {
    if (farm_.scheduler.is_referenced(blob.digest)) continue;
    BATON_ASSIGN(const bool is_kept, farm_.journal.is_kept(blob.digest));
    if (is_kept || !farm_.store.remove(blob.digest)) continue;
    ++count;
    bytes += blob.size_bytes;
  }
  if (count > 0)
    spdlog::info("{} blobs that no job needs, {}, are removed from the store", count,
                 bytes_text(bytes));
  for (const Digest& job : farm_.store.old_job_files()) {
    BATON_ASSIGN(const std::optional<std::string> document, farm_.journal.document(job));
    if (!document) farm_.remove_job_file(job, JobStatus::cancelled);
  }
  return {};
}

Status Service::restore_job(const Digest& digest) {
  BATON_ASSIGN(JournalledJob known, farm_.journal.load(digest));
  Result<ParsedJobDocument> document = parse_farm_document(known.document);
  if (!document) {
    spdlog::error("job {} of the journal cannot be read and is left out: {}",
                  farm_.history.name_of(digest), document.error().message);
    has_unread_jobs_ = true;
    return {};
  }
  if (is_open(known.status)) BATON_TRY(LockKeeper(farm_).settle(document->job));
  JobAdded event{digest, std::move(document->job), known.status, std::move(known.completions),
                 std::move(known.failures)};
  event.spec.leading_runs = known.plan.leading_runs;
  event.spec.priority =
      farm_.history.jobs().priority(farm_.history.jobs().of(digest).id, event.spec.priority);
  event.former = std::move(known.former);
  event.plan = std::move(known.plan);
  event.renderer = held_to(known.renderer, known.is_mixed, farm_.options.mixed_builds);
  event.is_mixed = known.is_mixed;

  // An open job needs every file that it counts on. What cannot be looked at now is not gone: the
  // job waits to be resumed.
  bool lacks_mark = false;
  if (is_open(event.status)) {
    BATON_ASSIGN(const auto stood, farm_.journal.frame_files(digest));
    for (const auto& [frame, file] : stood) {
      if (file.digest != Digest() && frame.index() < event.spec.frames.size())
        files_.add({frame_path(event.spec, frame), file.stamp, file.digest, {}, digest.hex()});
    }
    LostFiles lost = find_lost_files(event, farm_.store, files_, farm_.locked(digest, event.spec));
    while (lost.unreadable && std::chrono::steady_clock::now() < patient_until_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      lost = find_lost_files(event, farm_.store, files_, farm_.locked(digest, event.spec));
    }
    const std::optional<std::string> mark = farm_.lost_mark(digest, event.spec);
    lacks_mark = mark && lost.all_frames_right();
    if (mark && !lacks_mark && !lost.unreadable) lost.unreadable = mark;
    if (lost.unreadable) {
      spdlog::error("job {} is paused, resume it when that is mended: {}",
                    farm_.history.name_of(digest), *lost.unreadable);
      event.status = JobStatus::paused;
      event.waits = *lost.unreadable;
      BATON_TRY(farm_.journal.record_status(digest, event.status));
    } else {
      if (lost.num_unknown > 0) farm_.to_inspect.emplace(digest, std::chrono::steady_clock::now());
      tell_lost(farm_.history.name_of(digest), lost);
      if (!lost.tasks.empty()) farm_.lost_before[digest] = lost_reasons(lost);
      event.lost = std::move(lost.tasks);
      event.lost_spares = std::move(lost.spares);
    }
  }
  const JobStatus status = event.status;
  BATON_TRY(farm_.step(std::move(event)));
  if (is_open(status)) {
    BATON_TRY(farm_.history.take_up_times(digest, *farm_.scheduler.find_job(digest)));
    BATON_TRY(LockKeeper(farm_).leave_frames(digest));
  }
  if (lacks_mark) BATON_TRY(farm_.mark_output_again(digest));
  // What is locked stands in the mark; whoever was killed may not have come to that.
  if (const Result<std::string> marked = farm_.mark_output(digest); !marked) return marked.error();
  if (!is_open(status)) farm_.note_ended(digest);
  farm_.remove_job_file(digest, status);
  const JobProgress progress = farm_.scheduler.find_job(digest)->tasks.progress();
  spdlog::info("job {} of the journal: {} of {} tasks are done", farm_.history.name_of(digest),
               progress.tasks_done, progress.tasks_total);
  return {};
}

// ---- what people do with jobs -------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const JobDocumentRequest& message) {
  if (const Status own = farm_.check_own(speaker_, message.job); !own)
    return farm_.refuse(peer, own.error());
  BATON_ASSIGN(std::optional<std::string> document, farm_.journal.document(message.job));
  if (!document) {
    return farm_.refuse(
        peer, {ErrorKind::bad_input, fmt::format("job {}: not known here", message.job.hex())});
  }
  std::string token;
  if (!farm_.peers.worker_of(peer).empty()) {
    if (const Result<bool> watched = watch_folder(message.job); !watched) return watched.error();
    BATON_ASSIGN(token, farm_.mark_output(message.job));
  }
  return farm_.reply(peer, JobDocument{message.job, std::move(*document), std::move(token),
                                       farm_.history.jobs().of(message.job).id});
}

Status Service::receive(const PeerId& peer, const CancelJob& message) {
  if (const Result<Digest> job = resolve_own(message.job)) {
    BATON_TRY(
        farm_.take_back(farm_.history.jobs().of(*job).id, [](const std::string&) { return true; }));
  }
  return change_job<JobCancelled>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const PauseJob& message) {
  return change_job<JobPaused>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const ResumeJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  std::string plan;
  const Scheduler::Job* const known = farm_.scheduler.find_job(*job);
  if (known != nullptr && known->status == JobStatus::paused) {
    BATON_TRY(LockKeeper(farm_).settle(known->spec));
    BATON_ASSIGN(const SharedDocument document, journalled_document(farm_.journal, *job));
    if (!document->parsed) return farm_.refuse(peer, document->parsed.error());
    BATON_ASSIGN(const std::optional<OddFrames> odd,
                 await_frames(peer, message, *document->parsed, farm_.history.jobs().of(*job).id,
                              farm_.locked(*job, known->spec)));
    if (!odd) return {};
    BATON_ASSIGN(LostFiles lost, Submission(farm_, files_, speaker_).lost_files_of(*job));
    if (lost.unreadable && may_pass(*job))
      return farm_.refuse(peer, {ErrorKind::timeout, "waits for " + *lost.unreadable});
    if (lost.unreadable) {
      return farm_.refuse(
          peer, {ErrorKind::io, fmt::format("job {} stays paused: {}", farm_.history.name_of(*job),
                                            *lost.unreadable)});
    }
    pass(*job);
    tell_lost(farm_.history.name_of(*job), lost);
    const std::vector<std::string> reasons = lost_reasons(lost);
    BATON_TRY(farm_.step(TasksReopened{*job, std::move(lost.tasks)}));
    BATON_TRY(farm_.step(JobResumed{*job}));
    plan = plan_text(*farm_.scheduler.find_job(*job), reasons);
  }
  return Questions(farm_).answer_detail(peer, *job, std::move(plan));
}

/// Frames are locked whose files are there and that nobody writes now.
Status Service::receive(const PeerId& peer, const LockFrames& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  BATON_ASSIGN(const SharedDocument shared, journalled_document(farm_.journal, *job));
  const Result<ParsedJobDocument>& document = shared->parsed;
  if (!document) return farm_.refuse(peer, document.error());
  const std::set<FrameNumber> sorted(message.frames.begin(), message.frames.end());
  const std::vector<FrameNumber> frames(sorted.begin(), sorted.end());
  LockKeeper locks(farm_);
  BATON_TRY(locks.settle(document->job));
  const JobId id = farm_.history.jobs().of(*job).id;
  const std::vector<FrameNumber> before = farm_.history.jobs().locked(id);
  const std::int64_t changed_ms = lock_time_ms(farm_.history.jobs(), id);
  const Scheduler::Job* const known = farm_.scheduler.find_job(*job);
  const bool is_open_now = known != nullptr && is_open(known->status);
  // Renamed for good or away for a moment: what is in it is unlocked, and nothing is made in its
  // place.
  std::error_code error;
  const bool is_away = !std::filesystem::is_directory(document->job.output.directory, error);
  if (is_away && is_open_now)
    return farm_.refuse(
        peer, {ErrorKind::io, document->job.output.directory + ": the output folder is not there"});
  std::vector<FrameIndex> places;
  std::vector<FrameNumber> after;
  if (message.off) {
    const Status may = expect_locked(id, before, frames);
    if (!may) {
      // The folder may have been away when they were unlocked.
      BATON_TRY(locks.tell_again(document->job, id));
      return farm_.refuse(peer, may.error());
    }
    std::ranges::set_difference(before, frames, std::back_inserter(after));
  } else {
    Result<std::vector<FrameIndex>> found = frames_to_lock(document->job, frames, known);
    if (!found) return farm_.refuse(peer, found.error());
    places = std::move(found).value();
    std::ranges::set_union(before, frames, std::back_inserter(after));
  }
  // Of a job that has ended it counts how its frames stand then.
  if (!is_open_now && !is_away) {
    const LockedFrames locked(document->job, after);
    BATON_ASSIGN(const std::optional<OddFrames> odd,
                 await_frames(peer, message, *document, id, locked));
    if (!odd) return {};
  }
  // A lock that others cannot see is none: they would replace the frame.
  if (!message.off) {
    const Status told = locks.tell(document->job, id, {{after.begin(), after.end()}, changed_ms});
    if (!told)
      return farm_.refuse(peer, {told.error().kind, "nothing is locked: " + told.error().message});
  }
  BATON_TRY(farm_.history.locked(*job, frames, !message.off, changed_ms));
  const std::set<std::string> files = frame_files(document->job, frames);
  BATON_TRY(farm_.take_back(id, [&](const std::string& file) { return files.contains(file); }));
  spdlog::info("job {}: frames {} are {}", farm_.history.name_of(*job), format_frames(frames),
               message.off ? "unlocked" : "locked");
  BATON_TRY(farm_.step(FramesLocked{*job, std::move(places)}));
  if (const Result<std::string> marked = farm_.mark_output(*job); !marked) return marked.error();
  if (message.off) BATON_TRY(locks.tell_again(document->job, id));
  if (!is_away && !is_open_now)
    BATON_TRY(end_as_frames_stand(*document, {*job, id}, after, message.off ? &frames : nullptr));
  return Questions(farm_).answer_detail(peer, farm_.history.jobs().versions(id).back());
}

/// A job that has failed for its frames alone, or was done before some were unlocked (null: none
/// were), ends as they stand now. All of them were looked at.
Status Service::end_as_frames_stand(const ParsedJobDocument& document, const JobVersion& version,
                                    const std::vector<FrameNumber>& locked,
                                    const std::vector<FrameNumber>* unlocked) {
  const JobSpec& spec = document.job;
  BATON_ASSIGN(const FolderRecord record,
               FolderRecord::read(farm_.journal, farm_.history.jobs(), document, version.id));
  std::string fault =
      fault_text(find_odd_frames(record, files_, spec, LockedFrames(spec, locked)), version.id);
  if (unlocked != nullptr && fault.empty()) {
    // Behind a lock a frame may be of another picture.
    const Status is_free = Submission(farm_, files_, speaker_).expect_free_folder(document);
    if (!is_free) fault = is_free.error().message;
  }
  BATON_ASSIGN(const bool ends_again, farm_.ended_by_frames(version.document, fault, unlocked));
  if (!ends_again || !fault.empty()) return {};
  // The journal has the document.
  return Submission(farm_, files_, speaker_).submit(PeerId(), document, {{}, false, true}, {});
}

/// The scheduler's order changes, and no document.
Status Service::receive(const PeerId& peer, const SetPriority& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  const Scheduler::Job* const known = farm_.scheduler.find_job(*job);
  const std::string name = farm_.history.name_of(*job);
  if (known == nullptr || !is_open(known->status)) {
    return farm_.refuse(
        peer, {ErrorKind::usage,
               fmt::format("job {} has ended: only an open job has a place in the queue", name)});
  }
  if (message.priority < 0 || message.priority > limits::kMaxPriority) {
    return farm_.refuse(peer,
                        {ErrorKind::usage, fmt::format("priority: expected 0 to {}, got {}",
                                                       limits::kMaxPriority, message.priority)});
  }
  if (const Status may = check_priority(speaker_, message.priority, farm_.options.user_priority);
      !may)
    return farm_.refuse(peer, may.error());
  BATON_ASSIGN(const SharedDocument shared, journalled_document(farm_.journal, *job));
  const Result<ParsedJobDocument>& document = shared->parsed;
  if (!document) return farm_.refuse(peer, document.error());
  spdlog::info("job {}: priority {}, it was {}", name, message.priority, known->spec.priority);
  BATON_TRY(farm_.history.prioritized(*job, known->spec.priority,
                                      {document->job.priority, message.priority}));
  BATON_TRY(farm_.step(PriorityChanged{*job, message.priority}));
  return Questions(farm_).answer_detail(peer, *job);
}

Status Service::receive(const PeerId& peer, const DeleteJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  const std::string name = farm_.history.name_of(*job);
  const Scheduler::Job* const known = farm_.scheduler.find_job(*job);
  if (known != nullptr && is_open(known->status)) {
    return farm_.refuse(peer, {ErrorKind::usage, fmt::format("job {} is {}: cancel it first", name,
                                                             job_status_name(known->status))});
  }
  const JobId id = farm_.history.jobs().of(*job).id;
  BATON_ASSIGN(const SharedDocument shared, journalled_document(farm_.journal, *job));
  const Result<ParsedJobDocument>& document = shared->parsed;
  const std::vector<FrameNumber> locked = farm_.history.jobs().locked(id);
  if (document && !locked.empty()) {
    BATON_TRY(farm_.history.locked(*job, locked, false, lock_time_ms(farm_.history.jobs(), id)));
    BATON_TRY(LockKeeper(farm_).tell_again(document->job, id));
  }
  for (const Digest& version : farm_.history.jobs().versions(id)) {
    BATON_TRY(farm_.archive_job(version));
    BATON_ASSIGN(const std::vector<Digest> kept, farm_.journal.kept_blobs(version));
    farm_.garbage.add(kept);
    BATON_TRY(farm_.journal.delete_job(version));
    farm_.owners.erase(version);
    farm_.remove_job_file(version, JobStatus::cancelled);
  }
  BATON_TRY(farm_.history.deleted(*job));
  spdlog::info("job {} is deleted", name);
  return Questions(farm_).answer(peer, ListJobs{});
}

Status Service::receive(const PeerId& peer, const OrderWorker& message) {
  const std::string& worker = message.worker_id;
  if (!farm_.peers.peer_of(worker)) {
    return farm_.refuse(
        peer, {ErrorKind::bad_input, fmt::format("worker '{}': no worker has this name", worker)});
  }
  const bool is_held = farm_.history.past().is_held(worker);
  switch (message.order) {
    case WorkerOrder::drain:
      spdlog::info("worker {} is told to finish", worker);
      farm_.peers.drain(worker);
      BATON_TRY(farm_.history.happened(FarmEventKind::worker_drained, worker));
      BATON_TRY(farm_.reply_to(worker, Drain{}));
      break;
    case WorkerOrder::hold:
      if (is_held) break;
      spdlog::info("worker {} is held", worker);
      BATON_TRY(farm_.history.happened(FarmEventKind::worker_held, worker));
      BATON_TRY(farm_.step(WorkRequested{worker, 0}));
      break;
    case WorkerOrder::release:
      if (!is_held) break;
      // It asks again by itself.
      spdlog::info("worker {} is released", worker);
      BATON_TRY(farm_.history.happened(FarmEventKind::worker_released, worker));
      break;
  }
  return Questions(farm_).answer(peer, ListJobs{});
}

Status Service::receive(const PeerId& peer, const StopCoordinator&) {
  spdlog::info("asked to stop");
  BATON_TRY(farm_.history.happened(FarmEventKind::coordinator_stopped));
  stop_requested_ = true;
  return farm_.reply(peer, Shutdown{});
}

/// Event E happens to the job whose ID begins with `prefix`; the answer shows what came of it.
template <class E>
Status Service::change_job(const PeerId& peer, const std::string& prefix) {
  const Result<Digest> job = resolve_own(prefix);
  if (!job) return farm_.refuse(peer, job.error());
  BATON_TRY(farm_.step(E{*job}));
  return Questions(farm_).answer_detail(peer, *job);
}

}  // namespace baton
