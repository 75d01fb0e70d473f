#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_tasks.h"

namespace baton {

/// Who gets which task when: a pure state machine. It knows no clock, socket or file; time comes as
/// an argument and never decides what a task makes, only who makes it.
///
/// A task goes to the worker that asked first; of the tasks, the job of highest priority comes
/// first, then the job that was submitted first, then the order of TaskIndex. A retry goes to a
/// worker that has failed the task least.
class Scheduler {
 public:
  struct Job {
    JobSpec spec;
    JobStatus status = JobStatus::running;
    std::uint64_t sequence = 0;  ///< position in the order of submission
    JobTasks tasks;
  };

  /// epoch: how often the coordinator has started; part of each lease. silence_limit: a worker that
  /// says nothing for longer loses its leases.
  Scheduler(std::uint32_t epoch, std::chrono::milliseconds silence_limit);

  /// What follows from the event. Unknown jobs, workers and leases are normal: they are late, and
  /// nothing follows.
  std::vector<Action> step(const Event& event, TimePoint now);

  /// nullptr: no such job. Valid until the next JobAdded.
  const Job* find_job(const Digest& job) const;
  /// All jobs, in the order of submission.
  std::vector<Digest> jobs() const;
  /// Leases that the worker holds.
  std::size_t num_leases(const std::string& worker) const;
  bool is_referenced(const Digest& blob) const { return blobs_.contains(blob); }

 private:
  struct Lease {
    LeaseId id;
    std::string worker;
    TimePoint granted_at;
  };
  struct Worker {
    TimePoint last_sign;
    std::int32_t wanted = 0;
    std::set<std::pair<Digest, TaskIndex>> leases;
  };
  /// Orders the running jobs; a paused one has no rank.
  struct Rank {
    int descending_priority = 0;
    std::uint64_t sequence = 0;
    auto operator<=>(const Rank&) const = default;
  };
  /// A task that a worker holds.
  struct Held {
    Job* job = nullptr;
    TaskIndex task = 0;
  };
  using Actions = std::vector<Action>;

  void on(const JobAdded& event, TimePoint now, Actions& actions);
  void on(const JobCancelled& event, TimePoint now, Actions& actions);
  void on(const JobSuperseded& event, TimePoint now, Actions& actions);
  void on(const JobPaused& event, TimePoint now, Actions& actions);
  void on(const JobResumed& event, TimePoint now, Actions& actions);
  void on(const WorkerJoined& event, TimePoint now, Actions& actions);
  void on(const WorkerAlive& event, TimePoint now, Actions& actions);
  void on(const WorkerLeft& event, TimePoint now, Actions& actions);
  void on(const WorkRequested& event, TimePoint now, Actions& actions);
  void on(const TaskCompleted& event, TimePoint now, Actions& actions);
  void on(const AttemptFailed& event, TimePoint now, Actions& actions);
  void on(const ResultMissing& event, TimePoint now, Actions& actions);
  void on(const InputsLost& event, TimePoint now, Actions& actions);
  void on(const ClockTicked& event, TimePoint now, Actions& actions);

  // Leases (scheduler_leases.cpp).
  Worker* touch(const std::string& worker, TimePoint now);
  Held hold(const std::string& worker, const LeaseId& lease, TimePoint now);
  void reconcile(const std::string& worker, const std::vector<LeaseId>& named,
                 TimePoint granted_until, TimePoint now, Actions& actions);
  void add_lease(const std::string& worker, const LeaseId& lease, TaskIndex task, TimePoint now);
  void drop_lease(const Digest& job, TaskIndex task);
  void lose_lease(const Digest& job, TaskIndex task, Actions& actions);
  void remove_worker(const std::string& worker, bool lost, Actions& actions);
  void serve(TimePoint now, Actions& actions);
  bool grant_one(const std::string& worker, TimePoint now, Actions& actions);
  bool may_try(const Job& job, TaskIndex task, const std::string& worker) const;
  bool is_banned(const Job& job, const std::string& worker) const;
  bool everyone_is_banned(const Job& job) const;

  // Jobs (scheduler.cpp).
  Job* find(const Digest& job);
  Rank rank(const Job& job) const;
  void replay(Job& job, const JobAdded& event, Actions& actions);
  void reopen(const Digest& digest, Job& job, const std::vector<TaskKey>& tasks, Actions& actions);
  void fail_attempt(const Held& held, const Failure& failure, Actions& actions);
  void give_up(const Digest& digest, Job& job, TaskIndex task, const std::string& reason,
               Actions& actions);
  void end_if_finished(const Digest& digest, Job& job, Actions& actions);
  void end_job(const Digest& digest, Job& job, JobStatus status, const std::string& reason,
               Actions& actions);

  std::uint32_t epoch_;
  std::chrono::milliseconds silence_limit_;
  std::uint64_t next_sequence_ = 0;
  std::map<Digest, Job> jobs_;
  std::map<Rank, Digest> running_;
  std::map<std::pair<Digest, TaskIndex>, Lease> leases_;
  std::map<std::string, Worker> workers_;
  std::deque<std::string> hungry_;  ///< workers with wanted > 0, who asked first comes first
  BlobReferences blobs_;
};

}  // namespace baton
