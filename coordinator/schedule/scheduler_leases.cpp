#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {

// ---- events: workers ----------------------------------------------------------------------------

void Scheduler::on(const WorkerJoined& event, TimePoint now, Actions& actions) {
  Worker& worker = workers_[event.worker];
  worker.last_sign = now;
  worker.wanted = 0;
  std::erase(hungry_, event.worker);
  reconcile(event.worker, event.running, now, now, actions);
}

void Scheduler::on(const WorkerAlive& event, TimePoint now, Actions& actions) {
  // A lease so new that it may still be on its way need not be named.
  if (touch(event.worker, now))
    reconcile(event.worker, event.running, now - silence_limit_, now, actions);
}

void Scheduler::on(const WorkerLeft& event, TimePoint, Actions& actions) {
  remove_worker(event.worker, /*lost=*/false, actions);
}

void Scheduler::on(const WorkRequested& event, TimePoint now, Actions&) {
  Worker* worker = touch(event.worker, now);
  if (!worker) return;
  const bool was_hungry = worker->wanted > 0;
  worker->wanted = std::clamp(event.count, 0, limits::kMaxLeasesPerWorker);
  if (worker->wanted > 0 && !was_hungry) hungry_.push_back(event.worker);
  if (worker->wanted == 0 && was_hungry) std::erase(hungry_, event.worker);
}

void Scheduler::on(const ClockTicked&, TimePoint now, Actions& actions) {
  std::vector<std::string> silent;
  for (const auto& [id, worker] : workers_) {
    if (worker.last_sign + silence_limit_ < now) silent.push_back(id);
  }
  for (const std::string& id : silent) {
    remove_worker(id, /*lost=*/true, actions);
    actions.push_back(ForgetWorker{id});
  }
}

std::size_t Scheduler::num_leases(const std::string& worker) const {
  const auto found = workers_.find(worker);
  return found == workers_.end() ? 0 : found->second.leases.size();
}

// ---- leases -------------------------------------------------------------------------------------

/// Notes a sign of life. nullptr: the worker is not known.
Scheduler::Worker* Scheduler::touch(const std::string& worker, TimePoint now) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return nullptr;
  found->second.last_sign = now;
  return &found->second;
}

/// The task of a lease that the worker says it has. A lease that was lost, or granted by an earlier
/// coordinator, is taken up again while nobody else has the task. No job in the answer: the lease
/// is over.
Scheduler::Held Scheduler::hold(const std::string& worker, const LeaseId& lease, TimePoint now) {
  Job* job = find(lease.job);
  if (!job || !is_open(job->status)) return {};
  const std::optional<TaskIndex> task = job->tasks.graph().find(lease.task);
  if (!task) return {};

  if (job->tasks.status(*task) == TaskStatus::leased) {
    const Lease& current = leases_.at({lease.job, *task});
    return current.id == lease && current.worker == worker ? Held{job, *task} : Held{};
  }
  if (job->tasks.status(*task) != TaskStatus::ready || job->tasks.has_failed(*task, lease))
    return {};
  job->tasks.grant(*task);
  add_lease(worker, lease, *task, now);
  return {job, *task};
}

/// Compares the leases that a worker names with those it was granted at or before `granted_until`.
void Scheduler::reconcile(const std::string& worker, const std::vector<LeaseId>& named,
                          TimePoint granted_until, TimePoint now, Actions& actions) {
  // What it does not name is lost: the worker was started anew, or a message did not arrive.
  const std::set<LeaseId> in_hand(named.begin(), named.end());
  const auto before = workers_.at(worker).leases;
  for (const auto& [job, task] : before) {
    const auto lease = leases_.find({job, task});
    if (lease == leases_.end() || lease->second.granted_at > granted_until) continue;
    if (!in_hand.contains(lease->second.id)) lose_lease(job, task, actions);
  }

  // What it names it keeps, if nobody else has it.
  for (const LeaseId& lease : in_hand) {
    if (!hold(worker, lease, now).job) actions.push_back(RevokeLease{worker, lease});
  }
}

void Scheduler::add_lease(const std::string& worker, const LeaseId& lease, TaskIndex task,
                          TimePoint now) {
  leases_.insert_or_assign({lease.job, task}, Lease{lease, worker, now});
  workers_.at(worker).leases.emplace(lease.job, task);
}

void Scheduler::drop_lease(const Digest& job, TaskIndex task) {
  const auto found = leases_.find({job, task});
  BATON_CHECK(found != leases_.end());
  workers_.at(found->second.worker).leases.erase({job, task});
  leases_.erase(found);
}

/// The worker no longer has it, or nobody has what it made. A task that was lost too often probably
/// kills its workers.
void Scheduler::lose_lease(const Digest& digest, TaskIndex task, Actions& actions) {
  Job& job = jobs_.at(digest);
  const std::int32_t losses = job.tasks.add_loss(task);
  if (losses < limits::kMaxTaskAttempts) {
    drop_lease(digest, task);
    job.tasks.give_back(task);
  } else {
    const Lease lease = leases_.at({digest, task});
    fail_attempt({&job, task},
                 {lease.id, lease.worker,
                  fmt::format("its workers or results were lost {} times", losses), true},
                 actions);
  }
}

/// lost: the worker vanished, which counts against its tasks; else it said goodbye.
void Scheduler::remove_worker(const std::string& worker, bool lost, Actions& actions) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return;
  const auto leases = found->second.leases;
  for (const auto& [job, task] : leases) {
    // The end of a job may have taken the lease already.
    if (!leases_.contains({job, task})) continue;
    if (lost) {
      lose_lease(job, task, actions);
    } else {
      drop_lease(job, task);
      jobs_.at(job).tasks.give_back(task);
    }
  }
  std::erase(hungry_, worker);
  workers_.erase(found);
}

// ---- granting -----------------------------------------------------------------------------------

/// Gives ready tasks to whoever asked, one each in turn, until there is nothing that anyone may
/// have.
void Scheduler::serve(TimePoint now, Actions& actions) {
  const auto has_work = [this](const auto& entry) {
    return !jobs_.at(entry.second).tasks.ready().empty();
  };
  if (hungry_.empty() || std::none_of(running_.begin(), running_.end(), has_work)) return;
  std::deque<std::string> unserved;
  while (!hungry_.empty()) {
    const std::string worker = std::move(hungry_.front());
    hungry_.pop_front();
    if (!grant_one(worker, now, actions)) {
      unserved.push_back(worker);
    } else if (--workers_.at(worker).wanted > 0) {
      hungry_.push_back(worker);
    }
  }
  hungry_ = std::move(unserved);
}

bool Scheduler::grant_one(const std::string& worker, TimePoint now, Actions& actions) {
  for (const auto& [rank, digest] : running_) {
    Job& job = jobs_.at(digest);
    if (job.tasks.ready().empty() || is_banned(job, worker)) continue;
    for (const TaskIndex task : job.tasks.ready()) {
      if (!may_try(job, task, worker)) continue;
      const LeaseId lease{digest, job.tasks.graph().key(task), job.tasks.grant(task), epoch_};
      add_lease(worker, lease, task, now);
      actions.push_back(GrantLease{worker, lease, job.tasks.inputs(task)});
      return true;
    }
  }
  return false;
}

/// Whether no other connected worker has failed the task less often.
bool Scheduler::may_try(const Job& job, TaskIndex task, const std::string& worker) const {
  const std::int32_t own = job.tasks.num_failures(task, worker);
  return own == 0 || std::all_of(workers_.begin(), workers_.end(), [&](const auto& other) {
           return is_banned(job, other.first) || job.tasks.num_failures(task, other.first) >= own;
         });
}

bool Scheduler::is_banned(const Job& job, const std::string& worker) const {
  return job.tasks.num_failures(worker) >= job.spec.max_failures_per_worker;
}

bool Scheduler::everyone_is_banned(const Job& job) const {
  return std::all_of(workers_.begin(), workers_.end(),
                     [&](const auto& worker) { return is_banned(job, worker.first); });
}

}  // namespace baton
