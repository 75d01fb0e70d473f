#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/limits.h"
#include "common/job/plan/task_place.h"
#include "coordinator/schedule/held_states.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {
namespace {

/// Grant::steps. None for a cut: its state is that of the last step.
StepSpan steps_to_render(const JobTasks& tasks, TaskIndex task) {
  const TaskKey key = tasks.graph().key(task);
  if (key.kind == TaskKind::assemble) return {};
  const StepSpan steps = tasks.graph().steps(key);
  return tasks.ledger().is_cut(task) ? StepSpan{steps.last + 1, steps.last} : steps;
}

}  // namespace

std::string renderer_of(const Digest& digest, const Scheduler::Job& job, const LeaseBook& leases) {
  if (!job.renderer.empty()) return job.renderer;
  const Lease* const begun = leases.any_of(digest);
  return begun == nullptr ? std::string() : leases.renderer_of(begun->worker);
}

// ---- events: workers ----------------------------------------------------------------------------

void Scheduler::on(const WorkerJoined& event, TimePoint now, Actions& actions) {
  const bool is_new = leases_.join(event.worker, now, event.renderer);
  for (auto& [digest, job] : jobs_) {
    job.standings.forget(event.worker);
    job.tasks.attempts().forgive(event.worker);
    if (is_new) job.homes.share_out(leases_.alike(job.renderer));
  }
  lose_held(event.worker, actions);
  reconcile(event.worker, event.running, now, now, actions);
}

void Scheduler::on(const WorkerAlive& event, TimePoint now, Actions& actions) {
  // A lease so new that it may still be on its way need not be named.
  if (leases_.touch(event.worker, now))
    reconcile(event.worker, event.running, now - rules_.silence_limit, now, actions);
}

void Scheduler::on(const WorkerLeft& event, TimePoint, Actions& actions) {
  remove_worker(event.worker, /*lost=*/false, actions);
}

void Scheduler::on(const WorkRequested& event, TimePoint now, Actions&) {
  if (leases_.touch(event.worker, now)) leases_.want(event.worker, event.count);
}

void Scheduler::on(const ClockTicked&, TimePoint now, Actions& actions) {
  asked_.clear();  // an answer may be lost
  for (const std::string& id : leases_.silent_at(now, rules_.silence_limit)) {
    remove_worker(id, /*lost=*/true, actions);
    actions.push_back(ForgetWorker{id});
  }

  make_room(actions);

  // Workers end what takes too long themselves. Who does not, alive as it is, fails the task here.
  // A lease may wait on its worker for as long as the task before it may take.
  constexpr std::chrono::seconds kSlack{limits::kMaxSecondsToLoad + 60};
  std::vector<Lease> overdue;
  for (const auto& [place, lease] : leases_.all()) {
    const std::chrono::seconds task(jobs_.at(place.first).spec.max_seconds_per_task);
    if (now - lease.granted_at > 2 * task + kSlack) overdue.push_back(lease);
  }
  for (const Lease& lease : overdue) {
    const Claim claim = find_claim(lease.worker, lease.id, now, actions);
    if (!claim.job) continue;  // it went with one before
    actions.push_back(RevokeLease{lease.worker, lease.id});
    fail_attempt(claim,
                 {lease.id, lease.worker, "its worker has it for longer than maxSecondsPerTask",
                  /*permanent=*/false},
                 now, actions);
  }
}

std::size_t num_ready(const Scheduler& scheduler) {
  std::size_t count = 0;
  for (const Digest& job : scheduler.in_turn())
    count += scheduler.find_job(job)->tasks.book().ready().size();
  return count;
}

double longest_task_seconds(const Scheduler& scheduler) {
  double longest = 0;
  for (const Digest& job : scheduler.in_turn()) {
    const auto render = static_cast<std::size_t>(TaskKind::render);
    longest = std::max(longest, scheduler.find_job(job)->longest_seconds.at(render));
  }
  return longest;
}

// ---- leases -------------------------------------------------------------------------------------

/// The task of a lease that the worker says it has. A lease that was lost, or granted by an earlier
/// coordinator, is taken up again while nobody else has the task or holds what it was made of. No
/// job in the answer: the lease is over, or was never granted.
Scheduler::Claim Scheduler::find_claim(const std::string& worker, const LeaseId& lease,
                                       TimePoint now, Actions& actions) {
  Job* job = find(lease.job);
  if (!job || !is_open(job->status)) return {};
  const std::optional<TaskIndex> task = job->tasks.graph().find(lease.task);
  if (!task) return {};

  if (job->tasks.book().status(*task) == TaskStatus::leased) {
    const Lease& current = leases_.at({lease.job, *task});
    return current.id == lease && current.worker == worker ? Claim{job, *task} : Claim{};
  }
  const bool was_granted =
      lease.epoch < rules_.epoch || (lease.epoch == rules_.epoch && lease.attempt > 0 &&
                                     lease.attempt <= job->tasks.book().attempts(*task));
  if (!was_granted || job->tasks.book().status(*task) != TaskStatus::ready ||
      job->tasks.attempts().has_ended(*task, lease) || !can_read(job->tasks, *task, worker) ||
      !leases_.renders_as(worker, renderer_of(lease.job, *job, leases_)))
    return {};
  job->tasks.take_up(*task);
  add_lease(worker, lease, *task, now);
  actions.push_back(TellLeaseTaken{lease, worker});
  return {job, *task};
}

/// Compares the leases that a worker names with those it was granted at or before `granted_until`.
void Scheduler::reconcile(const std::string& worker, const std::vector<LeaseId>& named,
                          TimePoint granted_until, TimePoint now, Actions& actions) {
  // What it does not name is lost: the worker was started anew, or a message did not arrive.
  const std::set<LeaseId> in_hand(named.begin(), named.end());
  for (const auto& [job, task] : leases_.of_worker(worker)) {
    const Lease* const lease = leases_.find({job, task});
    if (lease == nullptr || lease->granted_at > granted_until) continue;
    if (!in_hand.contains(lease->id)) lose_lease(job, task, "its worker does not have it", actions);
  }

  // What it names it keeps, if nobody else has it.
  for (const LeaseId& lease : in_hand) {
    if (!find_claim(worker, lease, now, actions).job) actions.push_back(RevokeLease{worker, lease});
  }
}

Lease& Scheduler::add_lease(const std::string& worker, const LeaseId& lease, TaskIndex task,
                            TimePoint now) {
  Job& job = jobs_.at(lease.job);
  if (lease.task.kind == TaskKind::render) {
    job.homes.assign(lease.task.tile, worker);
    job.begun_runs = std::max(job.begun_runs, lease.task.run() + 1);
  }
  return leases_.add(task, {lease, worker, now, job.sizes.largest(job.tasks.graph(), lease.task)});
}

void Scheduler::end_lease(const Digest& job, TaskIndex task, LeaseEnd end,
                          const std::string& reason, Actions& actions) {
  const Lease lease = leases_.drop({job, task});
  for (const Digest& blob : lease.left) blobs_.discard(blob);
  actions.push_back(TellLeaseEnd{lease.id, lease.worker, end, lease.granted_at, reason});
}

void Scheduler::revoke_lease(const Digest& job, TaskIndex task, Actions& actions) {
  const Lease& lease = leases_.at({job, task});
  actions.push_back(RevokeLease{lease.worker, lease.id});
  end_lease(job, task, LeaseEnd::revoked, {}, actions);
}

/// A lease that ends without a result, and without anybody's failure.
void Scheduler::return_lease(const Claim& claim, const LeaseId& lease, const std::string& reason,
                             Actions& actions) {
  const std::string worker = leases_.at({lease.job, claim.task}).worker;
  end_lease(lease.job, claim.task, LeaseEnd::returned, reason, actions);
  claim.job->tasks.attempts().add_returned(claim.task, lease, worker);
  claim.job->tasks.give_back(claim.task);
}

/// The worker no longer has it, or nobody has what it made: no failure. But a task that was lost
/// too often probably kills its workers, and people should look at it.
void Scheduler::lose_lease(const Digest& digest, TaskIndex task, const std::string& reason,
                           Actions& actions) {
  Job& job = jobs_.at(digest);
  end_lease(digest, task, LeaseEnd::lost, reason, actions);
  job.tasks.give_back(task);
  count_loss(digest, job, task, actions);
}

/// The task's worker or result was lost. False: once too often, and the job is paused.
bool Scheduler::count_loss(const Digest& digest, Job& job, TaskIndex task, Actions& actions) {
  const std::int32_t losses = job.tasks.attempts().add_loss(task);
  if (losses < limits::kMaxTaskLosses || job.status != JobStatus::running) return true;
  job.waits = fmt::format("somebody to look at {}: its workers or results were lost {} times",
                          task_text(job, job.tasks.graph().key(task)), losses);
  pause_job(digest, job, job.waits, actions);
  return false;
}

/// lost: the worker vanished, which counts against its tasks; else it said goodbye.
void Scheduler::remove_worker(const std::string& worker, bool lost, Actions& actions) {
  if (!leases_.knows(worker)) return;
  for (const auto& [job, task] : leases_.of_worker(worker)) {
    // The end of a job may have taken the lease already.
    if (leases_.find({job, task}) == nullptr) continue;
    if (lost) {
      lose_lease(job, task, "its worker is silent", actions);
    } else {
      end_lease(job, task, LeaseEnd::returned, "its worker left", actions);
      jobs_.at(job).tasks.give_back(task);
    }
  }
  leases_.leave(worker);
  for (auto& [digest, job] : jobs_) {
    job.homes.leave(worker);
    job.standings.forget(worker);
  }
  lose_held(worker, actions);
}

/// What the worker held in memory is gone: it is made again from the newest checkpoint.
void Scheduler::lose_held(const std::string& worker, Actions& actions) {
  for (auto& [digest, job] : jobs_) {
    if (is_open(job.status))
      reopen({digest, held_by(job.tasks, worker), "what worker " + worker + " held is gone"}, job,
             actions);
  }
}

// ---- granting -----------------------------------------------------------------------------------

/// Gives ready tasks to whoever asked, one each in turn, until there is nothing that anyone may
/// have.
void Scheduler::serve(TimePoint now, Actions& actions) {
  const auto has_work = [this](const auto& entry) {
    return !jobs_.at(entry.second).tasks.book().ready().empty();
  };
  if (leases_.hungry().empty() || std::none_of(running_.begin(), running_.end(), has_work)) return;
  leases_.serve([&](const std::string& worker) { return grant_one(worker, now, actions); });
  for (const std::string& worker : leases_.hungry()) {
    if (leases_.of_worker(worker).empty()) ask_for_states(worker, now, actions);
  }
}

/// The worker has nothing to do: if tasks that it might have are bound to workers that hold their
/// inputs, those should publish them.
void Scheduler::ask_for_states(const std::string& worker, TimePoint now, Actions& actions) {
  for (const auto& [rank, digest] : running_) {
    const Job& job = jobs_.at(digest);
    const Crew crew = job.crew(leases_, now);
    if (job.tasks.made().totals().num_held == 0 || rests(crew, worker) ||
        !leases_.renders_as(worker, job.renderer))
      continue;
    std::vector<TaskIndex> tasks;
    for (const TaskIndex task : job.tasks.book().ready()) {
      const TaskKey key = job.tasks.graph().key(task);
      if (key.kind != TaskKind::render || !job.is_due(task, worker, crew)) continue;
      if (key.run() > last_due_run(job.tasks.graph(), job.tasks.book(), job.max_frames_ahead))
        break;
      tasks.push_back(task);
    }
    // Its own tiles first, so that it need not move among those of others.
    std::stable_partition(tasks.begin(), tasks.end(), [&](TaskIndex task) {
      return job.homes.is_home(job.tasks.graph().key(task).tile, worker);
    });
    if (tasks.size() > kMaxTasksFreed) tasks.resize(kMaxTasksFreed);
    std::map<std::string, std::set<Digest>> wanted;  // by holder
    for (const TaskIndex task : tasks) {
      for (const auto& [holder, state] : held_inputs(job.tasks, task)) {
        if (holder != worker) wanted[holder].insert(state);
      }
    }
    std::uint64_t num_states = 0;
    for (const auto& [holder, states] : wanted) num_states += states.size();
    if (!room().fits(num_states * job.sizes.largest_state())) return;
    for (const auto& [holder, states] : wanted) {
      if (asked_.emplace(holder, digest).second)
        actions.push_back(AskForStates{holder, digest, {states.begin(), states.end()}});
    }
    if (!wanted.empty()) return;
  }
}

/// Two different results for one task are a bug or a broken machine: the job pauses, so that
/// somebody looks before more is made of them. Of a placeholder no bytes are known, and renderers
/// that take over from each other differ. Returns whether they are equal.
bool Scheduler::compare_results(const TaskCompleted& event, const std::vector<BlobRef>& expected,
                                const std::vector<BlobRef>& reported, Actions& actions) {
  const auto [e, r] = std::mismatch(expected.begin(), expected.end(), reported.begin(),
                                    reported.end(), [](const BlobRef& a, const BlobRef& b) {
                                      return a.is_placeholder() || b.is_placeholder() || a == b;
                                    });
  const Digest digest = event.lease.job;
  Job& job = jobs_.at(digest);
  const bool may_differ = rules_.may_take_over || job.is_mixed;
  if (may_differ || e == expected.end() || r == reported.end()) return true;
  const std::string& maker = job.tasks.made().maker(*job.tasks.graph().find(event.lease.task));
  actions.push_back(ReportConflict{event.lease, event.worker, maker, *e, *r});
  if (job.status != JobStatus::running) return false;
  const std::string place = task_text(job, event.lease.task);
  job.waits =
      maker == job.tasks.made().stranger()
          ? fmt::format(
                "somebody to look: worker {} has made other bytes of {} than were there "
                "before (`baton farm events` says who had made them)",
                event.worker, place)
          : fmt::format("somebody to look: workers {} and {} have made different bytes of {}",
                        maker, event.worker, place);
  pause_job(digest, job, job.waits, actions);
  return false;
}

/// Whether the worker, which renders otherwise than the job was begun, makes the frames that are
/// not done.
bool Scheduler::take_over(const std::string& worker, const Digest& digest, Job& job, TimePoint now,
                          Actions& actions) {
  if (!rules_.may_take_over || !leases_.nobody_renders_as(job.renderer)) {
    job.alone_since.reset();
    return false;
  }
  if (!job.alone_since) job.alone_since = now;
  if (now - *job.alone_since < rules_.silence_limit) return false;
  RecordReopened record{digest, {}, "who renders with " + job.renderer};
  for (const TaskIndex task : job.tasks.reopen_unfinished(blobs_))
    record.tasks.push_back(job.tasks.graph().key(task));
  if (!record.tasks.empty()) actions.push_back(std::move(record));
  job.renderer = leases_.renderer_of(worker);
  job.is_mixed = true;
  job.alone_since.reset();
  actions.push_back(RecordRenderer{digest, job.renderer, job.is_mixed});
  return true;
}

bool Scheduler::grant_one(const std::string& worker, TimePoint now, Actions& actions) {
  Room before = Room::enough;
  for (const auto& [rank, digest] : running_) {
    Job& job = jobs_.at(digest);
    if (job.tasks.book().ready().empty()) continue;
    if (!leases_.renders_as(worker, renderer_of(digest, job, leases_)) &&
        !take_over(worker, digest, job, now, actions))
      continue;
    const Crew crew = job.crew(leases_, now);
    if (rests(crew, worker)) continue;
    const JobGraph& graph = job.tasks.graph();
    RoomOfTasks room(*this, job, before);
    const auto task = job.homes.choose(
        graph, job.tasks.book().ready(),
        last_due_run(graph, job.tasks.book(), job.max_frames_ahead), worker, [&](TaskIndex ready) {
          return job.is_due(ready, worker, crew) && can_read(job.tasks, ready, worker) &&
                 room(ready) == Room::enough;
        });
    if (!task) {
      before = std::max(before, room.lack());
      continue;
    }
    const LeaseId lease{digest, graph.key(*task), job.tasks.grant(*task), rules_.epoch};
    Lease& granted = add_lease(worker, lease, *task, now);
    granted.may_hold =
        baton::may_hold(job.tasks, *task) && job.homes.surround(lease.task.tile, worker);
    job.tasks.share_inputs(*task, worker, blobs_);
    // Where the last one found no space one tells whether there is some.
    TimePoint& rests_until = job.rests_until.at(static_cast<std::size_t>(lease.task.kind));
    if (rests_until != TimePoint()) rests_until = now + kRest;
    const double seconds = job.longest_seconds.at(static_cast<std::size_t>(lease.task.kind));
    actions.push_back(GrantLease{{.lease = lease,
                                  .inputs = job.tasks.ledger().inputs(job.tasks.view(), *task),
                                  .steps = steps_to_render(job.tasks, *task),
                                  .may_hold = granted.may_hold,
                                  .states_from = states_from(graph, job.tasks.book()),
                                  .expected_seconds = seconds},
                                 worker});
    return true;
  }
  return false;
}

bool Scheduler::Job::is_due(TaskIndex task, const std::string& worker, const Crew& workers) const {
  const TaskKind kind = tasks.graph().key(task).kind;
  return rests_until.at(static_cast<std::size_t>(kind)) <= workers.now &&
         may_try(workers, tasks.attempts().blame(task), worker);
}

}  // namespace baton
