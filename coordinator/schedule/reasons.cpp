#include "coordinator/schedule/reasons.h"

#include <algorithm>
#include <iterator>

#include "coordinator/schedule/held_states.h"

namespace baton {
namespace {

constexpr std::size_t kMostLinks = 8;
constexpr std::size_t kMostShown = 16;

/// The task to begin with: the first frame that is not written, else whatever is open.
std::optional<TaskIndex> first_open_task(const JobTasks& tasks) {
  const JobGraph& graph = tasks.graph();
  const FrameIndex frame = tasks.book().first_open_frame();
  if (frame < FrameIndex(graph.num_frames())) return graph.find(assemble_task(frame));
  for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
    if (is_open(tasks.book().status(task))) return task;
  }
  return std::nullopt;
}

/// What holds back tasks of later steps: an open task of the first step that is not done.
std::optional<TaskIndex> earliest_open_task(const JobTasks& tasks) {
  const JobGraph& graph = tasks.graph();
  const Run run = graph.timeline().run_of(first_open_step(graph, tasks.book()));
  for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile) {
    const std::optional<TaskIndex> task = graph.find(render_task(run, tile));
    if (task && is_open(tasks.book().status(*task))) return task;
  }
  return first_open_task(tasks);
}

/// Of what a blocked task needs, the one that is furthest from being done; nullopt: nothing, where
/// what it needs has failed.
std::optional<TaskIndex> furthest_input(const Scheduler::Job& job, TaskIndex task,
                                        const Crew& crew) {
  const auto rank = [&](TaskIndex input) {
    const TaskStatus status = job.tasks.book().status(input);
    if (!is_open(status)) return 0;
    const bool is_stuck =
        status == TaskStatus::ready && !somebody_may_try(crew, job.tasks.attempts().blame(input));
    return is_stuck ? 1 : 2 + static_cast<int>(status);
  };
  std::optional<TaskIndex> furthest;
  for (const TaskIndex input : job.tasks.graph().inputs(job.tasks.graph().key(task))) {
    if (job.tasks.book().status(input) == TaskStatus::done) continue;
    if (!furthest || rank(input) < rank(*furthest)) furthest = input;
  }
  return furthest;
}

/// A long chain without its middle.
std::vector<Cause> shortened(std::vector<Cause> chain) {
  if (chain.size() <= kMostLinks) return chain;
  const auto first = chain.begin() + kMostLinks / 2;
  const auto last = chain.end() - (kMostLinks / 2 - 1);
  const auto count = static_cast<std::size_t>(last - first);
  *first = {.kind = ReasonKind::skipped, .job = first->job, .count = count};
  chain.erase(first + 1, last);
  return chain;
}

Cause running_of(const Lease& lease) {
  return {.kind = ReasonKind::running,
          .job = lease.id.job,
          .task = lease.id.task,
          .workers = {lease.worker},
          .since = lease.granted_at};
}

}  // namespace

std::vector<Cause> Reasons::of_job(const Digest& digest) const {
  const Scheduler::Job& job = *scheduler_.find_job(digest);
  if (const auto end = end_of(digest, job)) return {*end};
  const std::optional<TaskIndex> task = first_open_task(job.tasks);
  if (!task) return {{.kind = ReasonKind::inspecting, .job = digest}};
  return shortened(walk(digest, job, *task));
}

std::vector<Cause> Reasons::of_task(const Digest& digest, TaskIndex task) const {
  const Scheduler::Job& job = *scheduler_.find_job(digest);
  const bool is_task_open = is_open(job.tasks.book().status(task));
  if (const auto end = end_of(digest, job); end && is_task_open) return {*end};
  return shortened(walk(digest, job, task));
}

std::vector<Cause> Reasons::of_worker(const std::string& worker) const {
  const LeaseBook& leases = scheduler_.leases();
  if (!leases.knows(worker)) return {{.kind = ReasonKind::gone}};
  Chain chain;
  for (const LeaseBook::Place& place : leases.of_worker(worker))
    chain.push_back(running_of(leases.at(place)));
  if (is_silent(worker)) chain.push_back(silence_of({worker}));
  if (conduct_.draining.contains(worker))
    chain.push_back({.kind = ReasonKind::draining, .workers = {worker}});
  if (!chain.empty()) return chain;
  for (const Digest& digest : scheduler_.in_turn()) {
    if (chain.size() >= kMostShown) break;
    const Scheduler::Job& job = *scheduler_.find_job(digest);
    if (const auto cause = refusal(worker, digest, job)) {
      chain.push_back(*cause);
    } else if (const auto task = chosen_for(worker, job)) {
      explain_free(digest, job, *task, worker, chain);
    } else {
      std::ranges::copy(of_job(digest), std::back_inserter(chain));
    }
  }
  if (!chain.empty()) return chain;
  chain.push_back({.kind = ReasonKind::no_job, .workers = {worker}});
  std::ranges::copy_if(scheduler_.jobs(), std::back_inserter(chain.back().jobs),
                       [&](const Digest& digest) {
                         return scheduler_.find_job(digest)->status == JobStatus::paused;
                       });
  return chain;
}

/// What keeps the whole job; nullopt: its tasks decide.
std::optional<Cause> Reasons::end_of(const Digest& digest, const Scheduler::Job& job) const {
  if (!is_open(job.status))
    return Cause{
        .kind = ReasonKind::ended, .job = digest, .text = std::string(job_status_name(job.status))};
  if (job.status == JobStatus::paused)
    return Cause{.kind = ReasonKind::paused, .job = digest, .text = job.waits};
  if (!job.waits.empty() && scheduler_.leases().any_of(digest) == nullptr)
    return Cause{.kind = ReasonKind::disk, .job = digest, .text = job.waits};
  return std::nullopt;
}

/// Goes from a task to what it needs, as far as that goes.
Reasons::Chain Reasons::walk(const Digest& digest, const Scheduler::Job& job,
                             TaskIndex task) const {
  const JobGraph& graph = job.tasks.graph();
  const Crew crew = job.crew(scheduler_.leases(), now_);
  Chain chain;
  std::set<TaskIndex> seen;
  while (seen.insert(task).second) {
    const TaskKey key = graph.key(task);
    const TaskStatus status = job.tasks.book().status(task);
    std::optional<TaskIndex> next;
    if (status == TaskStatus::leased) {
      explain_lease(scheduler_.leases().at({digest, task}), chain);
      return chain;
    }
    if (status == TaskStatus::blocked) {
      next = furthest_input(job, task, crew);
      if (next)
        chain.push_back(
            {.kind = ReasonKind::input, .job = digest, .task = key, .awaited = graph.key(*next)});
    } else if (status == TaskStatus::ready) {
      next = explain_ready(digest, job, task, chain);
      if (!next) return chain;
    }
    if (!next) {
      const char* const text = status == TaskStatus::done     ? "done"
                               : status == TaskStatus::failed ? "failed"
                                                              : "cancelled";
      chain.push_back({.kind = ReasonKind::ended, .job = digest, .task = key, .text = text});
      return chain;
    }
    task = *next;
  }
  chain.push_back({.kind = ReasonKind::asking,
                   .job = digest,
                   .task = graph.key(task),
                   .workers = scheduler_.leases().alike(job.renderer)});
  return chain;
}

/// Why nobody who is connected can have a ready task; nullopt: somebody can.
std::optional<Cause> Reasons::nobody_for(const Digest& digest, const Scheduler::Job& job,
                                         TaskIndex task) const {
  const LeaseBook& leases = scheduler_.leases();
  const TaskKey key = job.tasks.graph().key(task);
  Cause cause{.kind = ReasonKind::no_worker, .job = digest, .task = key};
  if (leases.connected().empty()) return cause;
  const std::string renderer = renderer_of(digest, job, leases);
  const std::vector<std::string>& alike = leases.alike(renderer);
  if (alike.empty()) {
    cause.kind = ReasonKind::renderer;
    cause.text = renderer;
    cause.workers = leases.connected();
    return cause;
  }
  cause.workers = alike;
  const Crew crew{alike, job.standings, now_};
  const auto is_blind = [&](const auto& w) { return job.standings.is_blind(w, now_); };
  if (std::ranges::all_of(alike, is_blind)) {
    cause.kind = ReasonKind::blind;
    cause.text = job.standings.unseen();
    return cause;
  }
  if (job.rests_until.at(static_cast<std::size_t>(key.kind)) > now_) {
    cause.kind = ReasonKind::disk;
    cause.text = job.waits;
    cause.workers.clear();
    return cause;
  }
  if (!somebody_may_try(crew, job.tasks.attempts().blame(task)))
    return tried(digest, job, task, alike);
  if (std::ranges::all_of(
          alike, [&](const auto& w) { return conduct_.draining.contains(w) || is_blind(w); })) {
    cause.kind = ReasonKind::draining;
    return cause;
  }
  return std::nullopt;
}

/// A worker gets nothing of a job, for that cause.
void Reasons::leave_out(const Cause& cause, Chain& chain) const {
  chain.push_back(cause);
  chain.back().kind = ReasonKind::left_out;
  chain.back().text = cause.kind == ReasonKind::renderer ? "does not render with " + cause.text
                      : cause.kind == ReasonKind::blind  ? "does not see " + cause.text
                                                         : "rests from it after failures";
}

/// Workers that are connected and have failed the task, which another one may try.
void Reasons::tell_failures(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
                            Chain& chain) const {
  for (const auto& [worker, own] : job.tasks.attempts().blame(task)) {
    if (!scheduler_.leases().knows(worker)) continue;
    chain.push_back({.kind = ReasonKind::left_out,
                     .job = digest,
                     .task = job.tasks.graph().key(task),
                     .workers = {worker},
                     .text = own.message,
                     .count = static_cast<std::size_t>(own.failures)});
  }
}

/// Those of the workers that have failed the task, with what they said last, or rest from the job
/// after other failures.
Cause Reasons::tried(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
                     const std::vector<std::string>& workers) const {
  Cause cause{.kind = ReasonKind::tried, .job = digest, .task = job.tasks.graph().key(task)};
  const TaskBlame blame = job.tasks.attempts().blame(task);
  for (const std::string& worker : workers) {
    const auto found = blame.find(worker);
    if (found != blame.end()) {
      cause.count += static_cast<std::size_t>(found->second.failures);
      cause.text = found->second.message;
    } else if (!job.standings.has_failed_much(worker, now_)) {
      continue;  // it is left out for something else
    }
    cause.workers.push_back(worker);
  }
  if (cause.workers.empty()) cause.workers = workers;
  return cause;
}

/// Why a ready task is not granted. Returns another task of the job that explains it further.
std::optional<TaskIndex> Reasons::explain_ready(const Digest& digest, const Scheduler::Job& job,
                                                TaskIndex task, Chain& chain) const {
  const LeaseBook& leases = scheduler_.leases();
  const JobGraph& graph = job.tasks.graph();
  const TaskKey key = graph.key(task);
  if (const auto cause = nobody_for(digest, job, task)) {
    if (cause->kind == ReasonKind::tried) {
      for (const std::string& worker : leases.alike(renderer_of(digest, job, leases)))
        if (job.standings.is_blind(worker, now_)) leave_out(*refusal(worker, digest, job), chain);
    }
    chain.push_back(*cause);
    return std::nullopt;
  }
  if (key.kind == TaskKind::render &&
      key.run() > last_due_run(graph, job.tasks.book(), job.max_frames_ahead)) {
    const std::optional<TaskIndex> first = earliest_open_task(job.tasks);
    chain.push_back({.kind = ReasonKind::order,
                     .job = digest,
                     .task = key,
                     .awaited = first ? std::optional(graph.key(*first)) : std::nullopt});
    return first;
  }

  // Who could do it, and what keeps the others from it.
  const Crew crew = job.crew(leases, now_);
  std::vector<std::string> able;
  const std::vector<std::string>& alike = leases.alike(renderer_of(digest, job, leases));
  for (const std::string& worker : alike) {
    if (const auto cause = refusal(worker, digest, job)) {
      leave_out(*cause, chain);
    } else if (!conduct_.draining.contains(worker) && job.is_due(task, worker, crew)) {
      able.push_back(worker);
    }
  }
  if (able.empty()) {
    chain.push_back(tried(digest, job, task, alike));
    return std::nullopt;
  }
  if (able.size() < alike.size()) tell_failures(digest, job, task, chain);
  std::vector<std::string> readers = able;
  std::erase_if(readers, [&](const auto& w) { return !can_read(job.tasks, task, w); });
  if (readers.empty()) {
    for (const auto& [holder, state] : held_inputs(job.tasks, task)) {
      if (std::ranges::find(readers, holder) == readers.end() && leases.knows(holder))
        readers.push_back(holder);
    }
    chain.push_back({.kind = ReasonKind::held, .job = digest, .task = key, .workers = readers});
    if (readers.empty()) readers = able;
  }
  const auto has_none = [&](const auto& w) { return leases.of_worker(w).empty(); };
  const auto free = std::ranges::find_if(
      readers, [&](const auto& w) { return !is_silent(w) && (leases.wants(w) || has_none(w)); });
  if (free != readers.end()) {
    explain_free(digest, job, task, *free, chain);
    return std::nullopt;
  }
  // Where others hold the store, a thread that comes free does not help.
  if (auto lack = lack_of_room(digest, job, task); lack && !lack->jobs.empty()) {
    tell_lack(*std::move(lack), chain);
    return std::nullopt;
  }
  std::vector<std::string> busy = readers;
  std::erase_if(busy, has_none);
  if (busy.empty()) {
    chain.push_back(silence_of(readers));
  } else {
    explain_busy(digest, key, busy, chain);
  }
  return std::nullopt;
}

/// The task of the job that the worker would be granted next.
std::optional<TaskIndex> Reasons::chosen_for(const std::string& worker,
                                             const Scheduler::Job& job) const {
  const JobGraph& graph = job.tasks.graph();
  const TaskBook& book = job.tasks.book();
  const Crew crew = job.crew(scheduler_.leases(), now_);
  return job.homes.choose(graph, book.ready(), last_due_run(graph, book, job.max_frames_ahead),
                          worker, [&](TaskIndex ready) {
                            return job.is_due(ready, worker, crew) &&
                                   can_read(job.tasks, ready, worker);
                          });
}

/// Why a worker that has nothing to do, or wants more, is not granted a task.
void Reasons::explain_free(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
                           const std::string& worker, Chain& chain) const {
  const JobGraph& graph = job.tasks.graph();
  const std::optional<TaskIndex> chosen = chosen_for(worker, job);
  if (chosen && *chosen != task) {
    chain.push_back({.kind = ReasonKind::order,
                     .job = digest,
                     .task = graph.key(task),
                     .awaited = graph.key(*chosen)});
    task = *chosen;
  }
  if (auto cause = lack_of_room(digest, job, task)) {
    tell_lack(*std::move(cause), chain);
  } else {
    chain.push_back(
        {.kind = ReasonKind::asking, .job = digest, .task = graph.key(task), .workers = {worker}});
  }
}

const Reasons::Before& Reasons::before(const Digest& job) const {
  if (before_.empty()) {
    Before so_far;
    for (const Digest& next : scheduler_.in_turn()) {
      before_[next] = so_far;
      const Scheduler::Job& other = *scheduler_.find_job(next);
      if (other.tasks.book().ready().empty()) continue;
      const Room lack = RoomOfTasks(scheduler_, other, so_far.lack).most();
      if (lack > so_far.lack) so_far = {lack, next};
    }
  }
  return before_[job];
}

/// Why the store has no room for the task; nullopt: it has.
std::optional<Cause> Reasons::lack_of_room(const Digest& digest, const Scheduler::Job& job,
                                           TaskIndex task) const {
  if (scheduler_.room().limit == 0) return std::nullopt;
  const Before& first = before(digest);
  if (scheduler_.room_for(job, task, first.lack) == Room::enough) return std::nullopt;
  const StoreRoom room = scheduler_.room();
  const std::uint64_t taken = room.used + room.expected;
  Cause cause{.kind = ReasonKind::store, .job = digest, .task = job.tasks.graph().key(task)};
  cause.need_bytes = needed_bytes(job.in_store(), task);
  cause.free_bytes = room.limit > taken ? room.limit - taken : 0;
  cause.ended_bytes = scheduler_.kept_bytes();
  cause.room = scheduler_.room_for(job, task, Room::enough);
  if (cause.room == Room::enough) {
    cause.jobs = {first.waiting.value()};  // which alone keeps it
    return cause;
  }
  for (const Digest& other : scheduler_.jobs()) {
    const Scheduler::Job& holder = *scheduler_.find_job(other);
    if (other == digest || holder.begun_runs == Run(0) || !is_open(holder.status)) continue;
    cause.jobs.push_back(other);
    if (holder.status == JobStatus::running) cause.aside_bytes += begun_bytes(holder.in_store());
  }
  return cause;
}

/// One that a person holds back holds its room, too.
void Reasons::tell_lack(Cause cause, Chain& chain) const {
  const std::vector<Digest> holders = cause.jobs;
  chain.push_back(std::move(cause));
  for (const Digest& holder : holders) {
    const Scheduler::Job& other = *scheduler_.find_job(holder);
    if (other.status != JobStatus::paused) continue;
    chain.push_back(*end_of(holder, other));
    chain.back().jobs = {holder};
    return;
  }
}

/// All workers that could do a task have others.
void Reasons::explain_busy(const Digest& digest, const TaskKey& task,
                           const std::vector<std::string>& workers, Chain& chain) const {
  const LeaseBook& leases = scheduler_.leases();
  Cause busy{.kind = ReasonKind::busy, .job = digest, .task = task};
  const Lease* oldest = nullptr;
  for (const std::string& worker : workers) {
    busy.workers.push_back(worker);
    for (const LeaseBook::Place& place : leases.of_worker(worker)) {
      const Lease& lease = leases.at(place);
      if (oldest == nullptr || lease.granted_at < oldest->granted_at) oldest = &lease;
      if (std::ranges::find(busy.jobs, place.first) == busy.jobs.end())
        busy.jobs.push_back(place.first);
    }
  }
  chain.push_back(std::move(busy));
  explain_lease(*oldest, chain);
}

bool Reasons::is_silent(const std::string& worker) const {
  return scheduler_.leases().silence_of(worker, now_) > conduct_.silent_after;
}

/// workers: at least one.
Cause Reasons::silence_of(const std::vector<std::string>& workers) const {
  TimePoint since = now_;
  for (const std::string& worker : workers) {
    const auto silence = scheduler_.leases().silence_of(worker, now_);
    since = std::min(since, now_ - std::chrono::duration_cast<TimePoint::duration>(silence));
  }
  return {.kind = ReasonKind::silent, .workers = workers, .since = since};
}

/// A worker has the task, and may say nothing any more.
void Reasons::explain_lease(const Lease& lease, Chain& chain) const {
  chain.push_back(running_of(lease));
  if (is_silent(lease.worker)) chain.push_back(silence_of({lease.worker}));
}

/// Why the worker gets nothing of the job, whatever is ready; nullopt: it may.
std::optional<Cause> Reasons::refusal(const std::string& worker, const Digest& digest,
                                      const Scheduler::Job& job) const {
  const LeaseBook& leases = scheduler_.leases();
  Cause cause{.kind = ReasonKind::renderer, .job = digest, .workers = {worker}};
  const std::string renderer = renderer_of(digest, job, leases);
  if (!leases.renders_as(worker, renderer)) {
    cause.text = renderer;
    return cause;
  }
  if (job.standings.is_blind(worker, now_)) {
    cause.kind = ReasonKind::blind;
    cause.text = job.standings.unseen_by(worker);
    return cause;
  }
  if (rests(job.crew(leases, now_), worker)) {
    cause.kind = ReasonKind::tried;
    return cause;
  }
  return std::nullopt;
}

}  // namespace baton
