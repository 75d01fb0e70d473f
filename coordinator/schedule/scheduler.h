#pragma once

#include <array>
#include <chrono>
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/farm_event.h"
#include "coordinator/schedule/blob_sizes.h"
#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_tasks.h"
#include "coordinator/schedule/lease_book.h"
#include "coordinator/schedule/policy.h"
#include "coordinator/schedule/standings.h"
#include "coordinator/schedule/store_room.h"
#include "coordinator/schedule/tile_homes.h"

namespace baton {

/// Who gets which task when: a pure state machine, without clock, socket or file. Time comes as an
/// argument and never decides what a task makes, only who makes it.
///
/// A task goes to the first worker in line; of the tasks, the job of highest priority comes
/// first, then the job that was submitted first, then what TileHomes prefers, then the order of
/// TaskIndex. Nothing is rendered so far ahead of the first open frame that films pile up, and
/// nothing for which the store has no room (store_room.h). Who may try what is said in policy.h.
///
/// A task fails for good when as many workers have failed it as the job allows attempts, or, where
/// fewer are connected, when those have had all attempts or can do no more. A retry goes to a
/// worker that has failed the task least. A worker that fails much rests from the job for a
/// while, unless all would.
/// Lost leases are no failures; a task that loses too many pauses its job.
///
/// A job whose tasks are done is done when the files of its frames have been compared with the
/// record; what is gone by then is made again.
class Scheduler {
 public:
  /// Orders the running jobs; a paused one has no rank.
  struct Rank {
    int descending_priority = 0;
    std::uint64_t sequence = 0;
    auto operator<=>(const Rank&) const = default;
  };
  struct Job {
    JobSpec spec;
    JobStatus status = JobStatus::running;
    std::uint64_t sequence = 0;  ///< position in the order of submission
    JobTasks tasks;
    TileHomes homes;
    std::int32_t max_frames_ahead = 0;  ///< of the first open frame
    BlobSizes sizes;
    /// The one after the last of which a task was granted.
    Run begun_runs{0};
    /// Tasks of each kind, after one found no space and until one is done; 0: they do not.
    std::array<TimePoint, 3> rests_until = {};
    std::string waits = {};     ///< for what, as far as an event said so
    bool is_hopeless = false;   ///< the store was too small for it
    bool yields = false;        ///< see JobInStore
    std::string renderer = {};  ///< of what is done; empty: not known
    bool is_mixed = false;      ///< others have made some of it, too
    /// Since then nobody renders so, and others would take over.
    std::optional<TimePoint> alone_since = {};
    Standings standings = {};
    std::array<double, 3> longest_seconds = {};  ///< CPU time of tasks of each kind, of late

    Rank rank() const { return {-spec.priority, sequence}; }
    JobInStore in_store(bool may_go_on = true) const {
      return {spec, tasks.graph(), tasks.book(), sizes, begun_runs, may_go_on, yields};
    }
    /// Those that render as what is done of it.
    Crew crew(const LeaseBook& leases, TimePoint now) const {
      return {leases.alike(renderer), standings, now};
    }
    /// Whether the worker may try the task now, could it read its inputs.
    bool is_due(TaskIndex task, const std::string& worker, const Crew& workers) const;
  };

  struct Rules {
    /// How often the coordinator has started; part of each lease.
    std::uint32_t epoch = 0;
    /// A worker that says nothing for longer loses its leases.
    std::chrono::milliseconds silence_limit{};
    std::uint64_t store_limit = 0;  ///< bytes of the store; 0: no limit
    /// Of a job that one renderer began another makes the frames that are not done, where nobody
    /// who renders so was connected for the silence limit; else the job waits for one.
    bool may_take_over = false;
  };
  explicit Scheduler(const Rules& rules) : rules_(rules) {}

  /// How long tasks of a kind rest after one of them found no space; then one tries.
  static constexpr std::chrono::seconds kRest{10};
  /// For so many tasks held states are asked for at once where a worker has nothing to do.
  static constexpr std::size_t kMaxTasksFreed = 8;

  /// What follows from the event. Unknown jobs, workers and leases are normal: they are late, and
  /// nothing follows.
  std::vector<Action> step(const Event& event, TimePoint now);

  /// nullptr: no such job. Valid until the next JobAdded or JobForgotten.
  const Job* find_job(const Digest& job) const;
  std::size_t num_jobs() const { return jobs_.size(); }
  /// All jobs, in the order of submission.
  std::vector<Digest> jobs() const;
  /// Those that run, in the order in which workers are offered their tasks.
  std::vector<Digest> in_turn() const;
  /// Whether the job, which must be known, waits for somebody who renders as it was begun.
  bool lacks_renderer(const Digest& job) const {
    return !rules_.may_take_over && leases_.nobody_renders_as(jobs_.at(job).renderer);
  }
  /// What the store may hold and holds.
  StoreRoom room() const;
  /// Whether a ready task of the job may be granted (store_room.h). before: what jobs before this
  /// one wait for.
  Room room_for(const Job& job, TaskIndex task, Room before) const;
  /// What jobs that have ended leave in the store.
  std::uint64_t kept_bytes() const { return kept_bytes_; }
  /// What blobs take that somebody needs: jobs, and those that have ended (StoreKeeps).
  std::uint64_t store_bytes() const { return blobs_.size_bytes() + kept_bytes_; }
  /// Who is connected and has which lease.
  const LeaseBook& leases() const { return leases_; }
  bool is_referenced(const Digest& blob) const { return blobs_.contains(blob); }

 private:
  /// A task that a worker holds.
  struct Claim {
    Job* job = nullptr;
    TaskIndex task = 0;
  };
  using Actions = std::vector<Action>;

  void on(const JobAdded& event, TimePoint now, Actions& actions);
  void on(const JobCancelled& event, TimePoint now, Actions& actions);
  void on(const JobSuperseded& event, TimePoint now, Actions& actions);
  void on(const JobPaused& event, TimePoint now, Actions& actions);
  void on(const JobResumed& event, TimePoint now, Actions& actions);
  void on(const TasksReopened& event, TimePoint now, Actions& actions);
  void on(const FramesInspected& event, TimePoint now, Actions& actions);
  void on(const FramesLocked& event, TimePoint now, Actions& actions);
  void on(const JobForgotten& event, TimePoint now, Actions& actions);
  void on(const PriorityChanged& event, TimePoint now, Actions& actions);
  void on(const WorkerJoined& event, TimePoint now, Actions& actions);
  void on(const WorkerAlive& event, TimePoint now, Actions& actions);
  void on(const WorkerLeft& event, TimePoint now, Actions& actions);
  void on(const WorkRequested& event, TimePoint now, Actions& actions);
  void on(const TaskCompleted& event, TimePoint now, Actions& actions);
  void on(const AttemptFailed& event, TimePoint now, Actions& actions);
  void on(const ResultMissing& event, TimePoint now, Actions& actions);
  void on(const SpaceLacking& event, TimePoint now, Actions& actions);
  void on(const InputsLost& event, TimePoint now, Actions& actions);
  void on(const HeldPublished& event, TimePoint now, Actions& actions);
  void on(const LeaseReturned& event, TimePoint now, Actions& actions);
  void on(const PlaceTaken& event, TimePoint now, Actions& actions);
  void on(const AttemptLeft& event, TimePoint now, Actions& actions);
  void on(const StoreKeeps& event, TimePoint now, Actions& actions);
  void on(const ClockTicked& event, TimePoint now, Actions& actions);

  // Leases (scheduler_leases.cpp).
  Claim find_claim(const std::string& worker, const LeaseId& lease, TimePoint now,
                   Actions& actions);
  void reconcile(const std::string& worker, const std::vector<LeaseId>& named,
                 TimePoint granted_until, TimePoint now, Actions& actions);
  Lease& add_lease(const std::string& worker, const LeaseId& lease, TaskIndex task, TimePoint now);
  void revoke_lease(const Digest& job, TaskIndex task, Actions& actions);
  void end_lease(const Digest& job, TaskIndex task, LeaseEnd end, const std::string& reason,
                 Actions& actions);
  void return_lease(const Claim& claim, const LeaseId& lease, const std::string& reason,
                    Actions& actions);
  void lose_lease(const Digest& job, TaskIndex task, const std::string& reason, Actions& actions);
  void remove_worker(const std::string& worker, bool lost, Actions& actions);
  void lose_held(const std::string& worker, Actions& actions);
  void serve(TimePoint now, Actions& actions);
  void ask_for_states(const std::string& worker, TimePoint now, Actions& actions);
  bool grant_one(const std::string& worker, TimePoint now, Actions& actions);

  void make_room(Actions& actions);  // scheduler_room.cpp

  // Jobs (scheduler.cpp).
  Job* find(const Digest& job);
  void replay(Job& job, const JobAdded& event, Actions& actions);
  void reopen(RecordReopened record, Job& job, Actions& actions);
  bool compare_results(const TaskCompleted& event, const std::vector<BlobRef>& expected,
                       const std::vector<BlobRef>& reported, Actions& actions);
  void fail_attempt(const Claim& claim, Failure failure, TimePoint now, Actions& actions);
  bool take_over(const std::string& worker, const Digest& digest, Job& job, TimePoint now,
                 Actions& actions);
  void give_up(const Digest& digest, Job& job, TaskIndex task, const std::string& reason,
               Actions& actions);
  bool count_loss(const Digest& digest, Job& job, TaskIndex task, Actions& actions);
  void pause_job(const Digest& digest, Job& job, const std::string& reason, Actions& actions);
  void end_if_finished(const Digest& digest, Job& job, Actions& actions);
  void end_job(const Digest& digest, Job& job, JobStatus status, const std::string& reason,
               Actions& actions);

  Rules rules_;
  std::uint64_t next_sequence_ = 0;
  std::map<Digest, Job> jobs_;
  std::map<Rank, Digest> running_;
  LeaseBook leases_;
  /// Workers that were asked for states, with the job.
  std::set<std::pair<std::string, Digest>> asked_;
  BlobReferences blobs_;
  std::uint64_t kept_bytes_ = 0;  ///< what ended jobs leave
};

/// Tasks of running jobs that are ready.
std::size_t num_ready(const Scheduler& scheduler);
/// CPU time of the longest render tasks of running jobs, of late; 0: not known.
double longest_task_seconds(const Scheduler& scheduler);
/// A task of a job as people see it.
TaskPlace place_of(const Scheduler::Job& job, const TaskKey& task, std::uint32_t attempt = 0);
/// place_text of it, with its sweep where the job has several.
std::string task_text(const Scheduler::Job& job, const TaskKey& task);
/// What decides the bytes of the job's tasks: the renderer of what is done or, where nothing is, of
/// what is being done; empty: anybody may begin.
std::string renderer_of(const Digest& digest, const Scheduler::Job& job, const LeaseBook& leases);

/// The room for tasks of one job, asked for once for all tiles of a run or frame.
class RoomOfTasks {
 public:
  /// Both outlive it, and do not change meanwhile. before: as of Scheduler::room_for.
  RoomOfTasks(const Scheduler& scheduler, const Scheduler::Job& job, Room before)
      : scheduler_(scheduler), job_(job), before_(before) {}
  Room operator()(TaskIndex task);
  /// What tasks that were asked for wait for, at most.
  Room lack() const { return lack_; }
  /// The most that one of the ready tasks finds.
  Room most();

 private:
  const Scheduler& scheduler_;
  const Scheduler::Job& job_;
  const Room before_;
  std::map<std::pair<TaskKind, std::int32_t>, Room> known_;
  Room lack_ = Room::enough;
};

/// Whether a task in work made this blob before: it may be put again at any moment.
bool is_made_again(const Scheduler& scheduler, const Digest& blob);

}  // namespace baton
