#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <span>
#include <utility>

#include "common/base/limits.h"
#include "common/job/job_json.h"
#include "coordinator/service/job_report.h"
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
  BATON_TRY(journal_.commit());
  let_out();
  return {};
}

Status Service::restore_job(const Digest& digest) {
  BATON_ASSIGN(JournalledJob known, journal_.load(digest));
  Result<ParsedJobDocument> document = parse_job_document(known.document);
  if (!document) {
    spdlog::error("job {} of the journal cannot be read and is left out: {}", digest.short_hex(),
                  document.error().message);
    return {};
  }
  JobAdded event{digest, std::move(document->job), known.status, std::move(known.completions),
                 std::move(known.failures)};

  // A running job needs every file that it counts on; a job that has ended needs none until it is
  // submitted again. What cannot be looked at now is not gone: the job waits to be resumed.
  if (is_open(event.status)) {
    LostFiles lost = find_lost_files(event, store_);
    if (lost.unreadable) {
      spdlog::error("job {} is paused, resume it when that is mended: {}", digest.short_hex(),
                    *lost.unreadable);
      event.status = JobStatus::paused;
      BATON_TRY(journal_.record_status(digest, event.status));
    } else {
      tell_lost(digest, lost);
      event.lost = std::move(lost.tasks);
      event.lost_spares = std::move(lost.spares);
    }
  }
  const JobStatus status = event.status;
  BATON_TRY(step(std::move(event)));
  remove_job_file(digest, status);
  const JobProgress& progress = scheduler_.find_job(digest)->tasks.progress();
  spdlog::info("job {} of the journal: {} of {} tasks are done", digest.short_hex(),
               progress.tasks_done, progress.tasks_total);
  return {};
}

// ---- questions ----------------------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const JobDocumentRequest& message) {
  if (const Status own = check_own(message.job); !own) {
    refuse(peer, own.error());
    return {};
  }
  BATON_ASSIGN(std::optional<std::string> document, journal_.document(message.job));
  if (document) {
    reply(peer, JobDocument{message.job, std::move(*document)});
  } else {
    refuse(peer, {ErrorKind::bad_input, fmt::format("job {}: not known here", message.job.hex())});
  }
  return {};
}

Status Service::receive(const PeerId& peer, const SubmitJob& message) {
  // A job that cannot be run is refused before it leaves a trace.
  Result<ParsedJobDocument> document = parse_job_document(message.json);
  if (!document) {
    refuse(peer, document.error());
    return {};
  }
  if (const Status within = check_roots(*document, options_.roots); !within) {
    spdlog::warn("refused: job '{}': {}", document->job.name, within.error().message);
    refuse(peer, within.error());
    return {};
  }
  if (const std::int64_t count = count_tasks(document->job); count > limits::kMaxTasksPerJob) {
    refuse(
        peer,
        {ErrorKind::bad_input,
         fmt::format("job {}: {} tasks, at most {}: use larger tiles or more frames per checkpoint",
                     document->digest.short_hex(), count, limits::kMaxTasksPerJob)});
    return {};
  }

  if (const Status way = make_way(*document, message.restart); !way) {
    const ErrorKind kind = way.error().kind;
    if (kind != ErrorKind::bad_input && kind != ErrorKind::usage) return way;
    refuse(peer, way.error());
    return {};
  }

  const Digest digest = document->digest;
  JobAdded event{digest, std::move(document->job), JobStatus::running, {}, {}};
  bool already_there = false;
  if (const Scheduler::Job* known = scheduler_.find_job(digest)) {
    const bool changes = known->status != JobStatus::running;
    if (const Status own = check_own(digest); changes && !own) {
      refuse(peer, own.error());
      return {};
    }
    BATON_TRY(start_again(std::move(event), known->status, already_there));
  } else {
    if (scheduler_.jobs().size() >= limits::kMaxJobs) {
      refuse(peer, {ErrorKind::io,
                    fmt::format("the journal is full: {} jobs; `baton job delete` removes some",
                                limits::kMaxJobs)});
      return {};
    }
    spdlog::info("job {} submitted: '{}', {} tasks", digest.short_hex(), event.spec.name,
                 count_tasks(event.spec));
    BATON_TRY(journal_.add_job(digest, message.json));
    if (!speaker_.name.empty()) {
      owners_[digest] = speaker_.name;
      BATON_TRY(journal_.record_owner(digest, speaker_.name));
    }
    BATON_TRY(step(event));
  }
  reply(peer, JobAccepted{digest, already_there});
  return {};
}

/// A frame belongs to one job. Those whose frames the new one would replace end, if that is wanted
/// or their pictures are the same; bad_input: it is not.
Status Service::make_way(const ParsedJobDocument& document, bool restart) {
  std::vector<JobSuperseded> superseded;
  for (const Digest& digest : scheduler_.jobs()) {
    if (digest == document.digest) continue;
    const Scheduler::Job& rival = *scheduler_.find_job(digest);
    std::vector<TaskKey> replaced = replaced_frames(rival, document.job);
    if (replaced.empty()) continue;
    BATON_TRY(check_own(digest));
    BATON_ASSIGN(const std::optional<std::string> text, journal_.document(digest));
    const Result<ParsedJobDocument> other = parse_job_document(text.value_or(""));
    const std::vector<std::string> differing =
        other ? picture_differences(*other, document) : std::vector<std::string>{"the whole job"};
    if (!differing.empty() && !restart) {
      constexpr std::size_t kMost = 8;
      const auto shown = std::span(differing).first(std::min(kMost, differing.size()));
      return Error{
          ErrorKind::bad_input,
          fmt::format("job '{}': its frames would replace those of job {} ('{}', {}, {} of {} "
                      "frames) in {}, which is another picture; what differs: {}{}\n"
                      "--restart replaces them, another output.directory keeps them",
                      document.job.name, digest.short_hex(), rival.spec.name,
                      job_status_name(rival.status), rival.tasks.progress().frames_done,
                      rival.spec.frames.size(), document.job.output.directory,
                      fmt::join(shown, ", "), differing.size() > kMost ? ", ..." : "")};
    }
    superseded.push_back({digest, std::move(replaced)});
  }
  for (JobSuperseded& event : superseded) {
    spdlog::info("job {} makes way for job {}: {} frames", event.job.short_hex(),
                 document.digest.short_hex(), event.replaced.size());
    BATON_TRY(step(std::move(event)));
  }
  return {};
}

void Service::tell_lost(const Digest& job, const LostFiles& lost) {
  if (lost.tasks.empty()) return;
  spdlog::warn("job {}: {} is gone or has another size{}", job.short_hex(), lost.first,
               lost.tasks.size() > 1
                   ? fmt::format(", and something of {} more tasks", lost.tasks.size() - 1)
                   : "");
}

/// A job that is known already: goes on where it stopped, and makes again what is gone. Who submits
/// it wants it as it now is: a folder that is not there is empty.
Status Service::start_again(JobAdded event, JobStatus status, bool& already_there) {
  already_there = true;
  if (status == JobStatus::running) return {};
  BATON_ASSIGN(LostFiles lost, lost_files_of(event.job));
  if (status == JobStatus::paused) {
    tell_lost(event.job, lost);
    return step(JobResumed{event.job, std::move(lost.tasks)});
  }
  BATON_ASSIGN(JournalledJob known, journal_.load(event.job));
  event.completions = std::move(known.completions);
  if (lost.tasks.empty() && status == JobStatus::done) return {};

  already_there = false;
  spdlog::info("job {} goes on", event.job.short_hex());
  tell_lost(event.job, lost);
  event.lost = std::move(lost.tasks);
  event.lost_spares = std::move(lost.spares);
  BATON_TRY(journal_.restart_job(event.job));
  return step(std::move(event));
}

Status Service::receive(const PeerId& peer, const ListJobs&) {
  JobList list;
  for (const Digest& job : scheduler_.jobs()) {
    list.jobs.push_back(summarize(job, *scheduler_.find_job(job)));
    list.jobs.back().owner = owner_of(job);
  }
  list.workers = peers_.summaries();
  for (WorkerSummary& worker : list.workers) {
    worker.leases = static_cast<std::int32_t>(scheduler_.num_leases(worker.worker_id));
  }
  reply(peer, std::move(list));
  return {};
}

Status Service::receive(const PeerId& peer, const ShowJob& message) {
  const Result<Digest> job = resolve_job(scheduler_, message.job);
  if (job) return answer_detail(peer, *job);
  refuse(peer, job.error());
  return {};
}

Status Service::receive(const PeerId& peer, const CancelJob& message) {
  return change_job<JobCancelled>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const PauseJob& message) {
  return change_job<JobPaused>(peer, message.job);
}

Status Service::receive(const PeerId& peer, const ResumeJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) {
    refuse(peer, job.error());
    return {};
  }
  if (scheduler_.find_job(*job)->status == JobStatus::paused) {
    BATON_ASSIGN(LostFiles lost, lost_files_of(*job));
    if (lost.unreadable) {
      refuse(peer, {ErrorKind::io,
                    fmt::format("job {} stays paused: {}", job->short_hex(), *lost.unreadable)});
      return {};
    }
    tell_lost(*job, lost);
    BATON_TRY(step(JobResumed{*job, std::move(lost.tasks)}));
  }
  return answer_detail(peer, *job);
}

Status Service::receive(const PeerId& peer, const DeleteJob& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) {
    refuse(peer, job.error());
    return {};
  }
  const JobStatus status = scheduler_.find_job(*job)->status;
  if (is_open(status)) {
    refuse(peer, {ErrorKind::usage, fmt::format("job {} is {}: cancel it first", job->short_hex(),
                                                job_status_name(status))});
    return {};
  }
  BATON_TRY(step(JobDeleted{*job}));
  return receive(peer, ListJobs{});
}

/// Of a job that the scheduler knows.
Result<LostFiles> Service::lost_files_of(const Digest& job) {
  BATON_ASSIGN(JournalledJob known, journal_.load(job));
  return find_lost_files(
      {job, scheduler_.find_job(job)->spec, JobStatus::running, std::move(known.completions), {}},
      store_);
}

Status Service::receive(const PeerId& peer, const DrainWorker& message) {
  if (!peers_.peer_of(message.worker_id)) {
    refuse(peer, {ErrorKind::bad_input,
                  fmt::format("worker '{}': no worker has this name", message.worker_id)});
    return {};
  }
  spdlog::info("worker {} is told to finish", message.worker_id);
  reply_to(message.worker_id, Drain{});
  return receive(peer, ListJobs{});
}

Status Service::receive(const PeerId& peer, const StopCoordinator&) {
  spdlog::info("asked to stop");
  stop_requested_ = true;
  reply(peer, Shutdown{});
  return {};
}

/// Event E happens to the job whose ID begins with `prefix`; the answer shows what came of it.
template <class E>
Status Service::change_job(const PeerId& peer, const std::string& prefix) {
  const Result<Digest> job = resolve_own(prefix);
  if (!job) {
    refuse(peer, job.error());
    return {};
  }
  BATON_TRY(step(E{*job}));
  return answer_detail(peer, *job);
}

Status Service::answer_detail(const PeerId& peer, const Digest& job) {
  BATON_ASSIGN(const std::vector<Failure> failures,
               journal_.recent_failures(job, kMaxFailuresShown));
  JobDetail detail = describe_job(scheduler_, job, failures);
  detail.summary.owner = owner_of(job);
  reply(peer, std::move(detail));
  return {};
}

}  // namespace baton
