#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/activity.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {

/// One link of a chain of reasons. Workers that it names are connected.
struct Cause {
  ReasonKind kind = ReasonKind::input;
  std::optional<Digest> job = {};
  std::optional<TaskKey> task = {};
  /// Of input and order: the task that comes first.
  std::optional<TaskKey> awaited = {};
  std::vector<std::string> workers = {};
  /// A folder, a renderer, or what a disk said; of tried: what the last one to fail said.
  std::string text = {};
  /// When the task was granted; of silent: the last sign of life of the one that said nothing for
  /// longest.
  std::optional<TimePoint> since = {};
  /// Of links that are left out; of tried: failures of the task.
  std::size_t count = 0;
  /// Of busy: whose tasks the workers have, each once. Of no_job: those that are paused. Of store:
  /// others that were begun; where there is room, the one that comes first. Of paused: another than
  /// the one that waits.
  std::vector<Digest> jobs = {};
  /// Of store; aside: of what is free, what others need for what they have begun.
  std::uint64_t need_bytes = 0, free_bytes = 0, ended_bytes = 0, aside_bytes = 0;
  Room room = Room::enough;
};

/// What only the one who talks with the workers knows of them.
struct Conduct {
  std::set<std::string> draining = {};  ///< who was told to take nothing new
  /// Who says nothing for longer counts as silent.
  std::chrono::milliseconds silent_after{std::chrono::hours(24)};
};

/// Why a scheduler does what it does, as chains of causes: from what somebody asks about to
/// something that no other link explains (is_last). Pure: it reads the scheduler as it stands.
class Reasons {
 public:
  /// scheduler: outlives the reasons, and does not change meanwhile.
  Reasons(const Scheduler& scheduler, TimePoint now, Conduct conduct = {})
      : scheduler_(scheduler), now_(now), conduct_(std::move(conduct)) {}

  /// Why the job, which must be known, is not further: of its first frame that is not written.
  std::vector<Cause> of_job(const Digest& job) const;
  /// Why the task of a job, which must be known, is not done.
  std::vector<Cause> of_task(const Digest& job, TaskIndex task) const;
  /// What the worker does, or why it does nothing.
  std::vector<Cause> of_worker(const std::string& worker) const;
  /// Whether a worker, which must be connected, says nothing any more.
  bool is_silent(const std::string& worker) const;

 private:
  using Chain = std::vector<Cause>;
  std::optional<Cause> end_of(const Digest& digest, const Scheduler::Job& job) const;
  Chain walk(const Digest& digest, const Scheduler::Job& job, TaskIndex task) const;
  std::optional<TaskIndex> explain_ready(const Digest& digest, const Scheduler::Job& job,
                                         TaskIndex task, Chain& chain) const;
  std::optional<Cause> nobody_for(const Digest& digest, const Scheduler::Job& job,
                                  TaskIndex task) const;
  Cause tried(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
              const std::vector<std::string>& workers) const;
  void leave_out(const Cause& cause, Chain& chain) const;
  void tell_failures(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
                     Chain& chain) const;
  std::optional<TaskIndex> chosen_for(const std::string& worker, const Scheduler::Job& job) const;
  void explain_free(const Digest& digest, const Scheduler::Job& job, TaskIndex task,
                    const std::string& worker, Chain& chain) const;
  std::optional<Cause> lack_of_room(const Digest& digest, const Scheduler::Job& job,
                                    TaskIndex task) const;
  void tell_lack(Cause cause, Chain& chain) const;
  void explain_busy(const Digest& digest, const TaskKey& task,
                    const std::vector<std::string>& workers, Chain& chain) const;
  Cause silence_of(const std::vector<std::string>& workers) const;
  void explain_lease(const Lease& lease, Chain& chain) const;
  std::optional<Cause> refusal(const std::string& worker, const Digest& digest,
                               const Scheduler::Job& job) const;

  /// What jobs that come before one wait for, and who of them waits for the most.
  struct Before {
    Room lack = Room::enough;
    std::optional<Digest> waiting = {};
  };
  const Before& before(const Digest& job) const;

  const Scheduler& scheduler_;
  TimePoint now_;
  Conduct conduct_;
  /// Of all jobs that run, once somebody has asked.
  mutable std::map<Digest, Before> before_;
};

}  // namespace baton
