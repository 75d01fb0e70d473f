#include "coordinator/service/questions.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/archive.h"
#include "common/base/limits.h"
#include "common/store/worker_logs.h"
#include "coordinator/service/answers.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/picture_source.h"

namespace baton {
namespace {

/// Attempts that have failed since the job was submitted last, whether it has ended or not, at most
/// 100 of them.
Result<std::vector<ListedTask>> failed_tasks(Journal& journal, const JobId& job) {
  constexpr std::size_t kMost = 100;
  std::vector<ListedTask> tasks;
  if (job.empty()) return tasks;
  BATON_ASSIGN(const std::vector<FarmEvent> events,
               journal.events({.job = job,
                               .count = limits::kMaxEventsTold,
                               .kinds = bit_of(FarmEventKind::task_failed) |
                                        bit_of(FarmEventKind::job_submitted) |
                                        bit_of(FarmEventKind::job_changed)}));
  for (const FarmEvent& event : events) {
    if (event.kind != FarmEventKind::task_failed) {
      tasks.clear();
      continue;
    }
    tasks.push_back({.job = job,
                     .has_task = event.has_task,
                     .task = event.task,
                     .worker = event.worker,
                     .has_failed = true,
                     .seconds = event.seconds,
                     .time_ms = event.time_ms,
                     .message = event.reason});
  }
  if (tasks.size() > kMost) tasks.erase(tasks.begin(), tasks.end() - kMost);
  return tasks;
}

}  // namespace

Status Questions::answer(const PeerId& peer, const ListJobs& message) {
  const IdentityBook& known = farm_.history.jobs();
  const Answers answers(farm_);
  JobList list = answers.list_workers();
  if (message.all) {
    BATON_ASSIGN(const std::vector<Bytes> ended,
                 farm_.journal.archived_summaries(limits::kMaxJobs));
    for (const Bytes& bytes : ended) {
      ArchiveReader reader(bytes);
      ListedJob job;
      reader(job.summary);
      if (reader.complete() && known.is_newest(job.summary.version))
        list.jobs.push_back(std::move(job));
    }
  }
  std::uint64_t num_open = 0;
  for (const Digest& version : farm_.scheduler.jobs()) {
    const Scheduler::Job& job = *farm_.scheduler.find_job(version);
    num_open += is_open(job.status) ? 1 : 0;
    if (known.is_newest(version)) list.jobs.push_back({known.of(version), summarize(version, job)});
  }
  list.num_ended = known.num_jobs() - num_open;
  for (ListedJob& job : list.jobs) {
    job.identity = known.of(job.summary.version);
    job.summary.owner = farm_.owner_of(job.summary.version);
    job.now = answers.now_of(job.summary.version, job.summary.status);
  }
  return farm_.reply(peer, std::move(list));
}

Status Questions::answer(const PeerId& peer, const ListEvents& message) {
  EventQuery query = message.query;
  query.count = std::clamp(query.count, 1, limits::kMaxEventsTold);
  if (!message.job.empty()) {
    const Result<Digest> version = resolve(message.job);
    // One that was deleted is known to the history alone.
    const std::optional<JobId> deleted = version ? std::nullopt : JobId::from_hex(message.job);
    query.job = version ? farm_.history.jobs().of(*version).id : deleted.value_or(JobId());
    BATON_ASSIGN(const auto any, farm_.journal.events({.job = query.job, .count = 1}));
    if (!version && (!deleted || any.empty())) return farm_.refuse(peer, version.error());
  }
  EventList list;
  list.logs = worker_logs(farm_.store_directory.parent_path()).string();
  BATON_ASSIGN(list.events, farm_.journal.events(query));
  if (!query.job.empty()) {
    BATON_ASSIGN(const auto sums, farm_.journal.event_sums(query.job));
    for (const auto& [kind, sum] : sums) {
      if (kind <= last_of(kind)) list.forgotten.push_back({kind, sum.count, sum.seconds});
    }
  }
  return farm_.reply(peer, std::move(list));
}

Result<Digest> Questions::resolve(const std::string& text) {
  BATON_ASSIGN(const std::vector<FoundJob> found,
               text.empty() ? std::vector<FoundJob>() : farm_.journal.find_jobs(text));
  return choose_job(found, text);
}

Status Questions::answer(const PeerId& peer, const ShowJob& message) {
  const Result<Digest> job = resolve(message.job);
  if (job) return answer_detail(peer, *job);
  return farm_.refuse(peer, job.error());
}

Status Questions::answer(const PeerId& peer, const AskWhy& message) {
  const Answers answers(farm_);
  Result<ReasonChain> chain = ReasonChain();
  if (message.job.empty()) {
    chain = answers.why_worker(message.worker);
  } else {
    const Result<Digest> job = resolve(message.job);
    if (!job) return farm_.refuse(peer, job.error());
    const Scheduler::Job* const known = farm_.scheduler.find_job(*job);
    BATON_ASSIGN(const auto ended,
                 known ? std::optional<JobDetail>() : farm_.archived_detail(*job));
    chain = answers.why_job(*job, ended ? ended->summary.status : JobStatus::running, message);
  }
  if (!chain) return farm_.refuse(peer, chain.error());
  return farm_.reply(peer, std::move(chain).value());
}

Status Questions::answer(const PeerId& peer, const ListTasks& message) {
  std::vector<Digest> jobs = farm_.scheduler.jobs();
  if (!message.job.empty()) {
    const Result<Digest> job = resolve(message.job);
    if (!job) return farm_.refuse(peer, job.error());
    jobs = {*job};
  }
  const Answers answers(farm_);
  TaskList list;
  for (const Digest& job : jobs) {
    for (ListedTask& task : answers.tasks_in_hand(job)) list.tasks.push_back(std::move(task));
    BATON_ASSIGN(std::vector<ListedTask> failed,
                 failed_tasks(farm_.journal, farm_.history.jobs().of(job).id));
    for (ListedTask& task : failed) list.tasks.push_back(std::move(task));
  }
  return farm_.reply(peer, std::move(list));
}

Status Questions::answer(const PeerId& peer, const AskPicture& message) {
  const Result<Digest> job = resolve(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  Result<PictureSource> source = Error{ErrorKind::internal, {}};
  if (const Scheduler::Job* const known = farm_.scheduler.find_job(*job)) {
    source = find_picture(known->spec, known->tasks, message);
  } else {
    BATON_ASSIGN(const std::optional<JobDetail> ended, farm_.archived_detail(*job));
    BATON_ASSIGN(const SharedDocument document, journalled_document(farm_.journal, *job));
    if (!document->parsed) return farm_.refuse(peer, document->parsed.error());
    source = find_written_picture(document->parsed->job,
                                  ended ? ended->frames_done : std::vector<FrameNumber>(), message);
  }
  if (!source) return farm_.refuse(peer, source.error());
  source->identity = farm_.history.jobs().of(*job);
  source->store_directory = farm_.store_directory.string();
  return farm_.reply(peer, std::move(source).value());
}

Status Questions::answer_detail(const PeerId& peer, const Digest& job, std::string plan) {
  BATON_ASSIGN(JobGrowth growth, farm_.journal.growth(farm_.history.jobs().of(job).id));
  if (farm_.scheduler.find_job(job) != nullptr) {
    ShownJob shown{farm_.history.jobs().of(job), {}};
    shown.growth = growth.said;
    shown.locked = farm_.history.jobs().locked(shown.identity.id);
    shown.lacks_renderer = farm_.scheduler.lacks_renderer(job);
    BATON_ASSIGN(shown.detail, farm_.living_detail(job));
    shown.detail.plan = std::move(plan);
    shown.detail.summary.owner = farm_.owner_of(job);
    shown.now = Answers(farm_).now_of(job, shown.detail.summary.status);
    return farm_.reply(peer, std::move(shown));
  }
  BATON_ASSIGN(std::optional<JobDetail> detail, farm_.archived_detail(job));
  if (!detail) {
    return farm_.refuse(
        peer, {ErrorKind::bad_input,
               fmt::format("job {}: its document cannot be read", farm_.history.name_of(job))});
  }
  detail->summary.owner = farm_.owner_of(job);
  const JobIdentity identity = farm_.history.jobs().of(job);
  const JobNow now = Answers(farm_).now_of(job, detail->summary.status);
  return farm_.reply(peer, ShownJob{identity, std::move(*detail), false, std::move(growth.said),
                                    farm_.history.jobs().locked(identity.id), now});
}

}  // namespace baton
