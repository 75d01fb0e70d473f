#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <span>
#include <utility>

#include "common/base/archive.h"
#include "common/base/limits.h"
#include "common/base/size_text.h"
#include "common/job/text/job_json.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/plan_text.h"
#include "coordinator/service/service.h"

namespace baton {
namespace {

constexpr int kMaxFailuresShown = 100;

}  // namespace

// ---- taking up the journal ----------------------------------------------------------------------

Status Service::restore_jobs() {
  BATON_ASSIGN(owners_, journal_.owners());
  BATON_ASSIGN(const std::vector<Digest> jobs, journal_.jobs());
  for (const Digest& job : jobs) BATON_TRY(restore_job(job));
  BATON_TRY(archive_ended());
  BATON_TRY(count_kept());
  BATON_TRY(journal_.commit());
  BATON_TRY(let_out());
  return sweep();
}

/// Removes what processes that died left in the store and neither an open job nor the archive
/// needs. A job that cannot be read may need anything.
Status Service::sweep() {
  next_sweep_ = std::chrono::steady_clock::now() + options_.sweep_every;
  const std::size_t unfinished = store_.sweep();
  if (unfinished > 0)
    spdlog::info("{} files that were never finished are removed from the store", unfinished);
  if (has_unread_jobs_) return {};
  std::size_t count = 0;
  std::uint64_t bytes = 0;
  for (const BlobStore::Leftover& blob : store_.old_blobs()) {
    if (scheduler_.is_referenced(blob.digest)) continue;
    BATON_ASSIGN(const bool is_kept, journal_.is_kept(blob.digest));
    if (is_kept || !store_.remove(blob.digest)) continue;
    ++count;
    bytes += blob.size_bytes;
  }
  if (count > 0)
    spdlog::info("{} blobs that no job needs, {}, are removed from the store", count,
                 bytes_text(bytes));
  for (const Digest& job : store_.old_job_files()) {
    BATON_ASSIGN(const std::optional<std::string> document, journal_.document(job));
    if (!document) remove_job_file(job, JobStatus::cancelled);
  }
  return {};
}

/// Tells the scheduler what ended jobs leave in the store.
Status Service::count_kept() {
  BATON_ASSIGN(const std::uint64_t bytes, journal_.kept_bytes());
  if (std::exchange(kept_bytes_, bytes) == bytes) return {};
  return step(StoreKeeps{bytes});
}

Status Service::restore_job(const Digest& digest) {
  BATON_ASSIGN(JournalledJob known, journal_.load(digest));
  Result<ParsedJobDocument> document = parse_job_document(known.document);
  if (!document) {
    spdlog::error("job {} of the journal cannot be read and is left out: {}", digest.short_hex(),
                  document.error().message);
    has_unread_jobs_ = true;
    return {};
  }
  JobAdded event{digest, std::move(document->job), known.status, std::move(known.completions),
                 std::move(known.failures)};
  event.spec.leading_runs = known.plan.leading_runs;
  event.plan = std::move(known.plan);

  // An open job needs every file that it counts on. What cannot be looked at now is not gone: the
  // job waits to be resumed.
  if (is_open(event.status)) {
    LostFiles lost = find_lost_files(event, store_);
    if (lost.unreadable) {
      spdlog::error("job {} is paused, resume it when that is mended: {}", digest.short_hex(),
                    *lost.unreadable);
      event.status = JobStatus::paused;
      BATON_TRY(journal_.record_status(digest, event.status));
    } else {
      tell_lost(digest, lost);
      if (!lost.tasks.empty()) lost_before_[digest] = lost_reasons(lost);
      event.lost = std::move(lost.tasks);
      event.lost_spares = std::move(lost.spares);
    }
  }
  const JobStatus status = event.status;
  BATON_TRY(step(std::move(event)));
  if (!is_open(status)) ended_.push_back(digest);
  remove_job_file(digest, status);
  const JobProgress progress = scheduler_.find_job(digest)->tasks.progress();
  spdlog::info("job {} of the journal: {} of {} tasks are done", digest.short_hex(),
               progress.tasks_done, progress.tasks_total);
  return {};
}

// ---- questions ----------------------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const JobDocumentRequest& message) {
  if (const Status own = check_own(message.job); !own) return refuse(peer, own.error());
  BATON_ASSIGN(std::optional<std::string> document, journal_.document(message.job));
  if (!document) {
    return refuse(peer,
                  {ErrorKind::bad_input, fmt::format("job {}: not known here", message.job.hex())});
  }
  const bool for_worker = !peers_.worker_of(peer).empty();
  return reply(peer, JobDocument{message.job, std::move(*document),
                                 for_worker ? mark_output(message.job) : std::string()});
}

void Service::tell_lost(const Digest& job, const LostFiles& lost) {
  if (lost.tasks.empty()) return;
  spdlog::warn("job {}: {} is gone or has another size{}", job.short_hex(), lost.first,
               lost.tasks.size() > 1
                   ? fmt::format(", and something of {} more tasks", lost.tasks.size() - 1)
                   : "");
}

Status Service::receive(const PeerId& peer, const ListJobs& message) {
  JobList list;
  if (message.all) {
    BATON_ASSIGN(const std::vector<Bytes> ended, journal_.archived_summaries(limits::kMaxJobs));
    for (const Bytes& bytes : ended) {
      ArchiveReader reader(bytes);
      reader(list.jobs.emplace_back());
      if (!reader.complete()) {
        list.jobs.pop_back();
        continue;
      }
      list.jobs.back().owner = owner_of(list.jobs.back().job);
    }
  }
  BATON_ASSIGN(list.num_ended, journal_.num_archived());
  for (const Digest& job : scheduler_.jobs()) {
    list.jobs.push_back(summarize(job, *scheduler_.find_job(job)));
    list.jobs.back().owner = owner_of(job);
  }
  list.tasks_ready = scheduler_.num_ready();
  list.task_seconds = scheduler_.longest_task_seconds();
  list.workers = peers_.summaries();
  for (WorkerSummary& worker : list.workers) {
    worker.leases = static_cast<std::int32_t>(scheduler_.num_leases(worker.worker_id));
  }
  return reply(peer, std::move(list));
}

Result<Digest> Service::resolve(const std::string& text) {
  BATON_ASSIGN(const std::vector<FoundJob> found,
               text.empty() ? std::vector<FoundJob>() : journal_.find_jobs(text));
  return choose_job(found, text);
}

Status Service::receive(const PeerId& peer, const ShowJob& message) {
  const Result<Digest> job = resolve(message.job);
  if (job) return answer_detail(peer, *job);
  return refuse(peer, job.error());
}

Status Service::receive(const PeerId& peer, const CancelJob& message) {
  return change_job<JobCancelled>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const PauseJob& message) {
  return change_job<JobPaused>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const ResumeJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return refuse(peer, job.error());
  std::string plan;
  const Scheduler::Job* const known = scheduler_.find_job(*job);
  if (known != nullptr && known->status == JobStatus::paused) {
    BATON_ASSIGN(const bool waits, await_frames(peer, message, *job, known->spec));
    if (waits) return {};
    BATON_ASSIGN(LostFiles lost, lost_files_of(*job));
    if (lost.unreadable) {
      return refuse(peer, {ErrorKind::io, fmt::format("job {} stays paused: {}", job->short_hex(),
                                                      *lost.unreadable)});
    }
    tell_lost(*job, lost);
    const std::vector<std::string> reasons = lost_reasons(lost);
    BATON_TRY(step(JobResumed{*job, std::move(lost.tasks)}));
    plan = plan_text(*scheduler_.find_job(*job), reasons);
  }
  return answer_detail(peer, *job, std::move(plan));
}

Status Service::receive(const PeerId& peer, const DeleteJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return refuse(peer, job.error());
  const Scheduler::Job* const known = scheduler_.find_job(*job);
  if (known != nullptr && is_open(known->status)) {
    return refuse(peer,
                  {ErrorKind::usage, fmt::format("job {} is {}: cancel it first", job->short_hex(),
                                                 job_status_name(known->status))});
  }
  BATON_TRY(archive_job(*job));
  BATON_ASSIGN(std::vector<Digest> kept, journal_.kept_blobs(*job));
  garbage_.insert(garbage_.end(), kept.begin(), kept.end());
  BATON_TRY(journal_.delete_job(*job));
  owners_.erase(*job);
  remove_job_file(*job, JobStatus::cancelled);
  spdlog::info("job {} is deleted", job->short_hex());
  return receive(peer, ListJobs{});
}

/// What is not there of a job that the scheduler knows.
Result<LostFiles> Service::lost_files_of(const Digest& job) {
  BATON_ASSIGN(JournalledJob known, journal_.load(job));
  return find_lost_files({.job = job,
                          .spec = scheduler_.find_job(job)->spec,
                          .completions = std::move(known.completions),
                          .failures = {},
                          .plan = std::move(known.plan)},
                         store_, &files_);
}

Status Service::receive(const PeerId& peer, const DrainWorker& message) {
  if (!peers_.peer_of(message.worker_id)) {
    return refuse(peer, {ErrorKind::bad_input,
                         fmt::format("worker '{}': no worker has this name", message.worker_id)});
  }
  spdlog::info("worker {} is told to finish", message.worker_id);
  BATON_TRY(reply_to(message.worker_id, Drain{}));
  return receive(peer, ListJobs{});
}

Status Service::receive(const PeerId& peer, const StopCoordinator&) {
  spdlog::info("asked to stop");
  stop_requested_ = true;
  return reply(peer, Shutdown{});
}

/// Event E happens to the job whose ID begins with `prefix`; the answer shows what came of it.
template <class E>
Status Service::change_job(const PeerId& peer, const std::string& prefix) {
  const Result<Digest> job = resolve_own(prefix);
  if (!job) return refuse(peer, job.error());
  BATON_TRY(step(E{*job}));
  return answer_detail(peer, *job);
}

/// Describes a job that is known here.
Result<JobDetail> Service::living_detail(const Digest& job) {
  BATON_ASSIGN(const std::vector<Failure> failures,
               journal_.recent_failures(job, kMaxFailuresShown));
  JobDetail detail = describe_job(scheduler_, job, failures);
  if (const auto notes = notes_.find(job); notes != notes_.end()) detail.notes = notes->second;
  return detail;
}

/// Describes a job that is known here or in the archive.
Status Service::answer_detail(const PeerId& peer, const Digest& job, std::string plan) {
  if (scheduler_.find_job(job) != nullptr) {
    BATON_ASSIGN(JobDetail detail, living_detail(job));
    detail.plan = std::move(plan);
    detail.summary.owner = owner_of(job);
    return reply(peer, std::move(detail));
  }
  BATON_ASSIGN(std::optional<JobDetail> detail, archived_detail(job));
  if (!detail) {
    return refuse(peer, {ErrorKind::bad_input,
                         fmt::format("job {}: its document cannot be read", job.short_hex())});
  }
  detail->summary.owner = owner_of(job);
  return reply(peer, std::move(*detail));
}

// ---- the archive --------------------------------------------------------------------------------

Result<std::optional<JobDetail>> Service::archived_detail(const Digest& job) {
  BATON_ASSIGN(const std::optional<Bytes> bytes, journal_.archived_detail(job));
  if (!bytes) return std::optional<JobDetail>();
  JobDetail detail;
  ArchiveReader reader(*bytes);
  reader(detail);
  if (!reader.complete())
    return Error{ErrorKind::corrupt,
                 fmt::format("the archived job {} cannot be read", job.short_hex())};
  return std::optional(std::move(detail));
}

/// Jobs that have ended leave the memory.
Status Service::archive_ended() {
  for (const Digest& job : std::exchange(ended_, {})) BATON_TRY(archive_job(job));
  return {};
}

/// A job that has ended leaves the memory; what people may ask of it, and its blobs that a later
/// job may go on from, stand in the archive. One that is there, or runs again, stays as it is.
Status Service::archive_job(const Digest& digest) {
  const Scheduler::Job* const job = scheduler_.find_job(digest);
  if (job == nullptr || is_open(job->status)) return {};
  std::vector<BlobRef> kept;
  for (TaskIndex task = job->tasks.graph().num_frames(); task < job->tasks.graph().num_tasks();
       ++task) {
    for (const auto& blobs : {job->tasks.ledger().live_blobs(job->tasks.view(), task),
                              job->tasks.ledger().spare_blobs(job->tasks.view(), task)}) {
      for (const BlobRef& blob : blobs) {
        if (!blob.is_held()) kept.push_back(blob);
      }
    }
    if (job->tasks.ledger().is_cut(task)) {
      for (const BlobRef& blob : job->tasks.ledger().inputs(job->tasks.view(), task))
        kept.push_back(blob);
    }
  }
  BATON_ASSIGN(const JobDetail detail, living_detail(digest));
  BATON_TRY(journal_.archive_job(digest, to_bytes(detail.summary), to_bytes(detail), kept));
  lost_before_.erase(digest);
  notes_.erase(digest);
  return step(JobForgotten{digest});
}

}  // namespace baton
