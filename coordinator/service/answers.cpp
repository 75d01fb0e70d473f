#include "coordinator/service/answers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <functional>

#include "common/base/size_text.h"
#include "common/base/utc.h"
#include "common/job/text/frame_range.h"

namespace baton {
namespace {

constexpr std::size_t kMostNames = 8;
constexpr std::chrono::milliseconds kAbsentFor{std::chrono::hours(24)};
/// Who was turned away and asks again does so sooner.
constexpr std::chrono::minutes kAsksAgainWithin{1};

/// "worker a", "workers a, b and 12 more".
std::string names_text(const std::vector<std::string>& names, const char* what = "worker") {
  if (names.empty()) return "nobody";
  const auto first = std::span(names).first(std::min(names.size(), kMostNames));
  return fmt::format(
      "{}{} {}{}", what, names.size() > 1 ? "s" : "", fmt::join(first, ", "),
      names.size() > kMostNames ? fmt::format(" and {} more", names.size() - kMostNames) : "");
}

Conduct conduct_of(const FarmCore& farm) {
  Conduct conduct{.silent_after = 2 * farm.options.heartbeat};
  for (const WorkerSummary& worker : farm.peers.summaries()) {
    if (worker.is_draining || farm.history.past().is_held(worker.worker_id))
      conduct.draining.insert(worker.worker_id);
  }
  return conduct;
}

/// What a task needs of another one.
std::string input_text(const Scheduler::Job& job, const TaskKey& task, const TaskKey& input) {
  if (task.kind == TaskKind::assemble) return fmt::format("its tile {}", input.tile);
  if (task.kind == TaskKind::second_pass)
    return fmt::format("the first pass of tile {}", input.tile);
  return "the state of " + task_text(job, input);
}

/// Why a worker is not here.
Reason absence_reason(const AbsentWorker& worker) {
  Reason reason{.kind = ReasonKind::gone, .workers = {worker.worker_id}};
  reason.since_ms = worker.since_ms;
  const std::string why = worker.reason.empty() ? "" : ": " + worker.reason;
  switch (worker.absence) {
    case Absence::lost:
      reason.text = fmt::format(
          "worker {} was silent for too long and is lost; its tasks went to "
          "others{}",
          worker.worker_id, why);
      break;
    case Absence::turned_away:
      reason.kind = ReasonKind::turned_away;
      reason.text = fmt::format("worker {} is turned away{}", worker.worker_id, why);
      break;
    case Absence::left:
      reason.text = fmt::format("worker {} has ended in order{}", worker.worker_id, why);
      break;
  }
  return reason;
}

JobActivity activity_of(JobStatus status) {
  switch (status) {
    case JobStatus::running:
      return JobActivity::queued;
    case JobStatus::paused:
      return JobActivity::paused;
    case JobStatus::done:
      return JobActivity::done;
    case JobStatus::failed:
      return JobActivity::failed;
    case JobStatus::cancelled:
      return JobActivity::cancelled;
  }
  return JobActivity::queued;
}

}  // namespace

Answers::Answers(const FarmCore& farm)
    : farm_(farm),
      now_(std::chrono::steady_clock::now()),
      reasons_(farm.scheduler, now_, conduct_of(farm)) {}

// ---- jobs ---------------------------------------------------------------------------------------

JobNow Answers::now_of(const Digest& version, JobStatus status) const {
  const Scheduler::Job* const job = farm_.scheduler.find_job(version);
  JobNow now{activity_of(status)};
  if (status == JobStatus::cancelled || status == JobStatus::done) return now;
  if (job == nullptr || !is_open(status)) {
    const FarmEvent* const change = farm_.history.past().last_change(id_of(version));
    if (change != nullptr && change->kind == FarmEventKind::job_failed) now.reason = change->reason;
    return now;
  }
  if (status == JobStatus::paused) {
    now.reason = pause_text(version, job->waits);
    return now;
  }
  if (farm_.scheduler.leases().any_of(version) != nullptr) {
    now.activity = JobActivity::rendering;
    now.eta = eta_of(version);
    return now;
  }
  const std::vector<Cause> chain = reasons_.of_job(version);
  const bool waits_for_turn =
      std::ranges::any_of(chain, [](const Cause& cause) { return cause.kind == ReasonKind::busy; });
  const Cause& last = chain.back();
  if (last.kind == ReasonKind::inspecting) {
    now = {JobActivity::rendering, text_of(last)};
  } else if (waits_for_turn || last.kind == ReasonKind::asking ||
             last.kind == ReasonKind::running) {
    const auto busy = std::ranges::find(chain, ReasonKind::busy, &Cause::kind);
    now.reason = busy == chain.end() ? std::string() : busy_text(*busy);
    now.eta = eta_of(version);
  } else {
    now = {JobActivity::waiting, text_of(last)};
  }
  return now;
}

Eta Answers::eta_of(const Digest& version) const {
  EtaBook::Slots slots;
  for (const WorkerSummary& worker : farm_.peers.summaries()) {
    // One task waits at each for a thread (Session::request_leases), and counts as in work.
    const bool takes = !worker.is_draining && !farm_.history.past().is_held(worker.worker_id);
    if (takes) slots.emplace_back(worker.worker_id, worker.num_threads + 1);
  }
  return farm_.history.etas().of(version, farm_.scheduler, slots, now_);
}

Result<ReasonChain> Answers::why_job(const Digest& version, JobStatus status,
                                     const AskWhy& question) const {
  ReasonChain chain;
  if (farm_.scheduler.find_job(version) == nullptr) {
    chain.reasons.push_back(end_reason(version, status));
    return chain;
  }
  BATON_ASSIGN(const std::vector<Cause> causes, causes_of(version, question));
  for (const Cause& cause : causes) chain.reasons.push_back(reason_of(cause));
  return chain;
}

Result<std::vector<Cause>> Answers::causes_of(const Digest& version, const AskWhy& question) const {
  if (!question.has_frame) return reasons_.of_job(version);
  const Scheduler::Job& job = *farm_.scheduler.find_job(version);
  const JobGraph& graph = job.tasks.graph();
  const auto frame = std::ranges::find(job.spec.frames, question.frame);
  if (frame == job.spec.frames.end()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("job {} has no frame {}: it has {}", farm_.history.name_of(version),
                             question.frame, format_frames(job.spec.frames))};
  }
  const auto index = FrameIndex(static_cast<std::int32_t>(frame - job.spec.frames.begin()));
  const TaskKey assembly = assemble_task(index);
  if (question.tile < 0) return reasons_.of_task(version, *graph.find(assembly));
  if (question.tile >= graph.num_tiles()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("job {} has no tile {}: it has 0 to {}",
                             farm_.history.name_of(version), question.tile, graph.num_tiles() - 1)};
  }
  return reasons_.of_task(version,
                          graph.inputs(assembly).at(static_cast<std::size_t>(question.tile)));
}

Reason Answers::end_reason(const Digest& version, JobStatus status) const {
  Reason reason{.kind = ReasonKind::ended,
                .text = fmt::format("the job is {}", job_status_name(status)),
                .job = id_of(version)};
  const FarmEvent* const change = farm_.history.past().last_change(reason.job);
  if (change == nullptr) return reason;
  reason.since_ms = change->time_ms;
  if (status == JobStatus::failed) reason.text += ": " + change->reason;
  return reason;
}

// ---- workers ------------------------------------------------------------------------------------

JobList Answers::list_workers() const {
  JobList list;
  list.tasks_ready = num_ready(farm_.scheduler);
  list.task_seconds = longest_task_seconds(farm_.scheduler);
  for (WorkerSummary& worker : farm_.peers.summaries())
    list.workers.push_back(describe(std::move(worker)));
  list.turned_away = farm_.peers.turned_away().asked_within(kAbsentFor, now_);
  list.lost = farm_.history.past().lost(now_ms() - kAbsentFor.count());
  return list;
}

WorkerSummary Answers::describe(WorkerSummary worker) const {
  const LeaseBook& leases = farm_.scheduler.leases();
  const std::string& name = worker.worker_id;
  for (const LeaseBook::Place& place : leases.of_worker(name)) {
    const Lease& lease = leases.at(place);
    const Scheduler::Job& job = *farm_.scheduler.find_job(lease.id.job);
    const std::chrono::duration<double> time = now_ - lease.granted_at;
    const JobId id = id_of(lease.id.job);
    worker.tasks.push_back({id, place_of(job, lease.id.task, lease.id.attempt), time.count(),
                            farm_.history.past().usual(id, lease.id.task.kind)});
  }
  std::ranges::stable_sort(worker.tasks, std::greater(), &TaskInHand::seconds);
  for (const Digest& version : farm_.scheduler.jobs()) {
    const Scheduler::Job& job = *farm_.scheduler.find_job(version);
    if (is_open(job.status) && job.standings.is_blind(name, now_))
      worker.blind.push_back({id_of(version), job.standings.unseen_by(name)});
  }
  if (!leases.knows(name)) return worker;
  worker.silent_s = leases.silence_of(name, now_).count();
  worker.is_held = farm_.history.past().is_held(name);
  worker.activity = reasons_.is_silent(name) ? WorkerActivity::silent
                    : worker.is_draining     ? WorkerActivity::draining
                    : worker.is_held         ? WorkerActivity::held
                    : worker.tasks.empty()   ? WorkerActivity::idle
                                             : WorkerActivity::rendering;
  return worker;
}

Result<ReasonChain> Answers::why_worker(const std::string& worker) const {
  ReasonChain chain;
  if (farm_.peers.peer_of(worker)) {
    for (const Cause& cause : reasons_.of_worker(worker)) chain.reasons.push_back(reason_of(cause));
    return chain;
  }
  const std::vector<AbsentWorker> asked = farm_.peers.turned_away().asked_within(kAbsentFor, now_);
  const auto turned_away = std::ranges::find(asked, worker, &AbsentWorker::worker_id);
  const AbsentWorker* const absent =
      turned_away != asked.end() ? &*turned_away : farm_.history.past().absent(worker);
  if (absent != nullptr) {
    chain.reasons.push_back(absence_reason(*absent));
    return chain;
  }
  return Error{ErrorKind::bad_input, fmt::format("worker '{}': no worker has this name", worker)};
}

// ---- tasks --------------------------------------------------------------------------------------

std::vector<ListedTask> Answers::tasks_in_hand(const Digest& version) const {
  std::vector<ListedTask> tasks;
  const Scheduler::Job* const job = farm_.scheduler.find_job(version);
  if (job == nullptr) return tasks;
  const JobId id = id_of(version);
  for (const TaskIndex task : farm_.scheduler.leases().of_job(version)) {
    const Lease& lease = farm_.scheduler.leases().at({version, task});
    const std::chrono::duration<double> time = now_ - lease.granted_at;
    tasks.push_back({.job = id,
                     .has_task = true,
                     .task = place_of(*job, lease.id.task, lease.id.attempt),
                     .worker = lease.worker,
                     .seconds = time.count(),
                     .usual = farm_.history.past().usual(id, lease.id.task.kind)});
  }
  std::ranges::stable_sort(tasks, std::greater(), &ListedTask::seconds);
  return tasks;
}

// ---- causes in words ----------------------------------------------------------------------------

Reason Answers::reason_of(const Cause& cause) const {
  Reason reason{.kind = cause.kind, .text = text_of(cause), .workers = cause.workers};
  reason.need_bytes = cause.need_bytes;
  reason.free_bytes = cause.free_bytes;
  const RecentPast& past = farm_.history.past();
  if (cause.job) {
    reason.job = id_of(*cause.job);
    if (cause.task) {
      reason.has_task = true;
      reason.task = place_of(*farm_.scheduler.find_job(*cause.job), *cause.task);
    }
    const FarmEvent* const change = past.last_change(reason.job);
    if (cause.kind == ReasonKind::paused && change != nullptr &&
        change->kind == FarmEventKind::job_paused)
      reason.since_ms = change->time_ms;
  }
  if (cause.since) {
    reason.seconds = std::chrono::duration<double>(now_ - *cause.since).count();
    if (cause.kind == ReasonKind::running) reason.usual = past.usual(reason.job, reason.task.kind);
  }
  if (cause.kind == ReasonKind::no_worker) {
    reason.since_ms = past.alone_since_ms();
    for (const AbsentWorker& worker :
         farm_.peers.turned_away().asked_within(kAsksAgainWithin, now_))
      reason.workers.push_back(worker.worker_id);
  }
  if (cause.kind == ReasonKind::no_job && !cause.jobs.empty())
    reason.job = id_of(cause.jobs.front());
  return reason;
}

std::string Answers::place(const Cause& cause) const {
  if (!cause.job) return "the farm";
  if (!cause.task) return "job " + farm_.history.name_of(*cause.job);
  return task_text(*farm_.scheduler.find_job(*cause.job), *cause.task);
}

std::string Answers::pause_text(const Digest& version, const std::string& waits) const {
  if (!waits.empty()) return "it waits for " + waits;
  const FarmEvent* const change = farm_.history.past().last_change(id_of(version));
  if (change == nullptr || change->kind != FarmEventKind::job_paused || change->actor.empty())
    return "by a person";
  return fmt::format("by {}{}", change->actor == farm_.owner_of(version) ? "its owner " : "",
                     change->actor);
}

/// Of an idle worker.
std::string Answers::paused_text(const std::vector<Digest>& jobs) const {
  if (jobs.empty()) return {};
  const Digest& first = jobs.front();
  const std::string why = pause_text(first, farm_.scheduler.find_job(first)->waits);
  const std::string name = farm_.history.name_of(first);
  if (jobs.size() == 1) return fmt::format("; job {} is paused: {}", name, why);
  return fmt::format("; {} jobs are paused, job {} for one: {}", jobs.size(), name, why);
}

/// Where nobody is connected.
std::string Answers::turned_away_text() const {
  std::vector<std::string> names;
  const auto asked = farm_.peers.turned_away().asked_within(kAsksAgainWithin, now_);
  for (const AbsentWorker& worker : asked) names.push_back(worker.worker_id);
  if (names.empty()) return {};
  return fmt::format("; {} {} and turned away: {}", names_text(names),
                     names.size() > 1 ? "are there" : "is there", asked.front().reason);
}

std::string Answers::busy_text(const Cause& cause) const {
  std::vector<std::string> jobs;
  for (const Digest& other : cause.jobs) {
    const int priority = farm_.scheduler.find_job(other)->spec.priority;
    if (other == *cause.job) {
      jobs.emplace_back("this job");
    } else if (priority > farm_.scheduler.find_job(*cause.job)->spec.priority) {
      jobs.push_back(
          fmt::format("job {} of higher priority, {}", farm_.history.name_of(other), priority));
    } else {
      jobs.push_back("job " + farm_.history.name_of(other));
    }
  }
  if (jobs.size() > kMostNames) {
    const std::size_t more = jobs.size() - kMostNames;
    jobs.resize(kMostNames);
    jobs.push_back(fmt::format("{} jobs more", more));
  }
  return fmt::format("{} that could do it {} tasks of {}",
                     cause.workers.size() == 1
                         ? "the only worker"
                         : fmt::format("all {} workers", cause.workers.size()),
                     cause.workers.size() == 1 ? "has" : "have", fmt::join(jobs, "; of "));
}

namespace {

/// What the workers have done, behind their names.
std::string tried_text(const Cause& cause, const std::string& place) {
  const bool many = cause.workers.size() > 1;
  if (cause.count == 0)
    return fmt::format("{} from its tasks after failures of others", many ? "rest" : "rests");
  return fmt::format("{} failed {}, {}{}", many ? "have" : "has", place,
                     cause.count == 1 ? "once" : fmt::format("{} times", cause.count),
                     cause.text.empty() ? "" : ", the last time: " + cause.text);
}

}  // namespace

std::string Answers::store_text(const Cause& cause, const std::string& place) const {
  std::vector<std::string> holders;
  for (const Digest& job : cause.jobs) holders.push_back(farm_.history.name_of(job));
  if (cause.room == Room::enough)
    return fmt::format("room in the store is left for {}, which comes before {}",
                       names_text(holders, "job"), place);
  const StoreRoom room = farm_.scheduler.room();
  if (cause.room == Room::beside)
    return fmt::format(
        "{} waits for the end of {}: a store of {} could not end both{}", place,
        names_text(holders, "job"), bytes_text(room.limit),
        cause.ended_bytes > 0
            ? fmt::format(", as jobs that have ended hold {} of it", bytes_text(cause.ended_bytes))
            : "");
  std::string text = fmt::format("the store has no room for all tiles of {}: they need {}, free {}",
                                 place, bytes_text(cause.need_bytes), bytes_text(cause.free_bytes));
  if (cause.aside_bytes > 0)
    text += fmt::format(", of which others need {} for what they have begun",
                        bytes_text(std::min(cause.aside_bytes, cause.free_bytes)));
  if (cause.ended_bytes > 0)
    text += fmt::format("; jobs that have ended hold {}", bytes_text(cause.ended_bytes));
  if (holders.empty())
    return room.is_idle && cause.ended_bytes == 0
               ? text + "; the job itself holds the rest: raise --store-limit"
               : text;
  return text + "; it also holds what is begun of " + names_text(holders, "job");
}

std::string Answers::text_of(const Cause& cause) const {
  const std::string who = names_text(cause.workers);
  const bool many = cause.workers.size() > 1;
  switch (cause.kind) {
    case ReasonKind::input:
    case ReasonKind::order: {
      const Scheduler::Job& job = *farm_.scheduler.find_job(*cause.job);
      const TaskKey awaited = cause.awaited.value_or(TaskKey());
      if (cause.kind == ReasonKind::order)
        return fmt::format("{} comes after {}: earlier frames come first", place(cause),
                           task_text(job, awaited));
      return fmt::format("{} waits for {}", place(cause), input_text(job, *cause.task, awaited));
    }
    case ReasonKind::busy:
      return fmt::format("{} is ready, and {}", place(cause), busy_text(cause));
    case ReasonKind::held:
      return fmt::format("a state that {} needs is in the memory of {}", place(cause), who);
    case ReasonKind::skipped:
      return fmt::format("and so on, {} times", cause.count);
    case ReasonKind::left_out:
      if (cause.task) return fmt::format("{} {}", who, tried_text(cause, place(cause)));
      return fmt::format("{} gets none of its tasks: it {}", who, cause.text);
    case ReasonKind::running:
      return fmt::format("{} is with {}", place(cause), who);
    case ReasonKind::no_worker:
      return "no worker is connected" + turned_away_text();
    case ReasonKind::renderer:
      return fmt::format("{} is for who renders with {}; {} not", place(cause), cause.text,
                         who + (many ? " do" : " does"));
    case ReasonKind::blind:
      return fmt::format("{} {} not see {}", who, many ? "do" : "does", cause.text);
    case ReasonKind::tried:
      return fmt::format("{} {}", who, tried_text(cause, place(cause)));
    case ReasonKind::store:
      return store_text(cause, place(cause));
    case ReasonKind::disk:
      return "it waits for " + (cause.text.empty() ? std::string("a disk") : cause.text);
    case ReasonKind::paused:
      return (cause.jobs.empty() ? "" : place(cause) + " is ") +
             (cause.text.empty() ? "paused " : "paused: ") + pause_text(*cause.job, cause.text);
    case ReasonKind::ended:
      return fmt::format("{} is {}", cause.task ? place(cause) : "the job", cause.text);
    case ReasonKind::draining:
      if (std::ranges::all_of(cause.workers, [this](const std::string& worker) {
            return farm_.history.past().is_held(worker);
          }))
        return fmt::format("{} {} held, and {} nothing new", who, many ? "are" : "is",
                           many ? "take" : "takes");
      return fmt::format("{} {}, and {} nothing new", who,
                         many ? "finish what they have" : "finishes what it has",
                         many ? "take" : "takes");
    case ReasonKind::asking:
      return fmt::format("{} {} free and will ask for {}", who, many ? "are" : "is", place(cause));
    case ReasonKind::inspecting:
      return "all tasks are done, and the frames are read once more";
    case ReasonKind::no_job:
      return "no job that runs has a task left" + paused_text(cause.jobs);
    case ReasonKind::gone:
      return "the worker is not connected";
    case ReasonKind::silent:
      return fmt::format("{} {} said nothing", who, many ? "have" : "has");
    case ReasonKind::turned_away:
      return who + " may not come in";
  }
  return {};
}

}  // namespace baton
