#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/schedule/blob_references.h"
#include "coordinator/schedule/checkpoints.h"
#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_graph.h"
#include "coordinator/schedule/task_status.h"

namespace baton {

/// What people are shown of a job.
struct JobProgress {
  std::uint64_t tasks_total = 0, tasks_done = 0, tasks_leased = 0, tasks_failed = 0;
  std::uint64_t tasks_open = 0;     ///< blocked, ready or leased
  std::uint64_t attempts_lost = 0;  ///< failed attempts and lost leases
  std::uint32_t frames_done = 0;
  std::uint64_t state_bytes = 0, state_pixels = 0;
  RenderStats stats;
  std::map<FrameIndex, FrameStats> frames;  ///< over the tiles and sweeps so far
};

/// How a worker failed a task.
struct Blame {
  std::int32_t failures = 0;
  bool for_good = false;  ///< it said that no retry of its own can help
};

/// All tasks of one job: their status, outputs and failures. Knows nothing of workers but their
/// names.
class JobTasks {
 public:
  explicit JobTasks(const JobSpec& spec);

  const JobGraph& graph() const { return graph_; }
  const JobProgress& progress() const { return progress_; }
  TaskStatus status(TaskIndex task) const { return record(task).status; }
  /// Sorted; empty unless the task is done.
  const std::vector<BlobRef>& outputs(TaskIndex task) const { return record(task).outputs; }
  /// Tasks that a worker may have, in the order in which they should be granted.
  const std::set<TaskIndex>& ready() const { return ready_; }
  /// The first frame that is not written and may still be; num_frames: there is none.
  FrameIndex first_open_frame() const { return first_open_frame_; }
  /// The first step that is not done: not rendered, or in the last sweep not written.
  Step first_open_step() const;
  /// The first run with an open render task; num_runs: there is none.
  Run first_open_run() const { return first_open_run_; }
  /// Render tasks of the run that are open.
  std::int32_t num_open_renders(Run run) const { return open_renders_[run.index()]; }
  /// States of earlier steps than this are inputs of no open task.
  Step states_from() const;
  /// Whether all tasks that it needs are done. A leased task may lose one of them.
  bool has_inputs(TaskIndex task) const { return record(task).missing_inputs == 0; }
  /// The blobs that the task needs: see LeaseGrant in PROTOCOL.md. It must have its inputs, or be
  /// a cut.
  std::vector<BlobRef> inputs(TaskIndex task) const;

  /// Takes up what an earlier coordinator recorded as done, in any order; of a fresh job only.
  /// Tasks that are none of the job's are left out. gone: spare_blobs() that are not there. A task
  /// that is recorded without outputs, or without the films of a cut, is opened again if an open
  /// task takes what it lacks, and so on back to what is there or can be cut. Returns those that
  /// were.
  std::vector<TaskIndex> restore(const Completions& completions, const std::vector<BlobRef>& gone,
                                 BlobReferences& blobs, const JobPlan& plan = {});
  /// Whether the task, which is not done, is a cut.
  bool is_cut(TaskIndex task) const { return cuts_.contains(task); }

  /// Leases a ready task. Returns the number of the attempt, from 1.
  std::uint32_t grant(TaskIndex task);
  /// Ends a leased task: its outputs must be complete and sorted (JobGraph::check_outputs).
  /// Releases its dependents, and the blobs that nobody needs any more. is_shared: other workers
  /// may read its state.
  void complete(TaskIndex task, const Completion& completion, const std::string& worker,
                bool is_shared, BlobReferences& blobs);

  // Held states (job_tasks_held.cpp): a worker may keep what it made between checkpoints in memory
  // and out of the store. Then it alone can read it, until it publishes it.

  /// Whether the state of a render task may be held: it is neither a checkpoint nor a result, and
  /// nothing of the job has failed yet, so no task must change its worker.
  bool may_hold(TaskIndex task) const;
  /// Whether the worker holds whichever of the task's inputs is held at all.
  bool can_read(TaskIndex task, const std::string& worker) const;
  /// The held inputs of a task that has its inputs, with the workers that hold them.
  std::vector<std::pair<std::string, Digest>> held_inputs(TaskIndex task) const;
  /// The tasks whose states, held by the worker, somebody still needs; with the worker they are
  /// gone.
  std::vector<TaskKey> held_by(const std::string& worker) const;
  /// The same of workers of an earlier coordinator, from which nothing can be had.
  std::vector<TaskKey> held_by_strangers() const { return held_by(makers_.front()); }
  /// The worker reads the task's inputs: those of others stay until the next checkpoint.
  void share_inputs(TaskIndex task, const std::string& worker, BlobReferences& blobs);
  /// A state that the worker holds is in the store now. nullopt: it does not hold it; else the task
  /// that made it.
  std::optional<TaskIndex> publish(const PublishedState& state, const std::string& worker,
                                   BlobReferences& blobs);
  /// Whether the task is done and its state is held.
  bool is_held(TaskIndex task) const { return held_state(task) != nullptr; }
  /// Held states that somebody needs now.
  std::size_t num_held() const { return held_now().size(); }
  /// Whether any state has been held and is not published.
  bool has_held() const { return num_held_ > 0; }

  /// The worker that completed the task last.
  const std::string& maker(TaskIndex task) const { return makers_[record(task).maker]; }
  /// Opens a leased task again: ready, or blocked when an input was lost meanwhile.
  void give_back(TaskIndex task);
  /// What a done task made is gone: it is done again, and so is whatever it needs and nobody kept,
  /// as far back as that goes. A task that is not done, but is a cut, is rendered instead. Returns
  /// those that were done.
  std::vector<TaskIndex> reopen(TaskIndex task, BlobReferences& blobs);
  /// What the task made when it was done before it was opened again; sorted, or empty.
  const std::vector<BlobRef>& former_outputs(TaskIndex task) const;
  /// Ends a leased task for good, and cancels what cannot be done without it. Returns what was
  /// leased of that: an input of it was lost meanwhile.
  std::vector<TaskIndex> give_up(TaskIndex task);
  /// Cancels whatever is open.
  void cancel_open();

  /// Remembers a failed attempt. From now on nothing is held, so nothing stays between checkpoints.
  void add_failure(TaskIndex task, const Failure& failure, BlobReferences& blobs);
  /// Remembers an attempt that was reported as not done and is nobody's failure.
  void add_returned(TaskIndex task, const LeaseId& lease, const std::string& worker);
  /// Whether this very attempt was reported as not done: it cannot be taken up again.
  bool has_ended(TaskIndex task, const LeaseId& lease) const;
  /// The tasks of which an attempt was reported as not done.
  std::vector<TaskIndex> tried() const;
  /// How often each worker failed the task.
  std::map<std::string, Blame> blame(TaskIndex task) const;
  /// Remembers a lost lease. Returns how many the task has lost.
  std::int32_t add_loss(TaskIndex task);
  /// The worker was started anew: what it could not do for good, it may try once more.
  void forgive(const std::string& worker);
  void forget_losses();

  /// Nothing between checkpoints stays for a worker that may be lost, now or later.
  void let_between_go(BlobReferences& blobs);
  /// Forgets every blob, of a job that is to be replaced.
  void release_all(BlobReferences& blobs);
  /// The blobs of the store that open tasks and the job's result need of what the task made.
  std::vector<BlobRef> live_blobs(TaskIndex task) const;
  /// Those that stay only for what may be lost, or come after the job (Checkpoints).
  std::vector<BlobRef> spare_blobs(TaskIndex task) const;

 private:
  struct Record {
    TaskStatus status = TaskStatus::blocked;
    bool is_shared = true;            ///< other workers may read its state
    bool films_let_go = false;        ///< they are not all there, and nobody counts on them
    std::int32_t missing_inputs = 0;  ///< input tasks that are not done, whatever its own status
    std::uint32_t attempts = 0;
    std::uint16_t losses = 0;
    std::uint16_t maker = 0;  ///< of makers_
    std::vector<BlobRef> outputs;
  };
  struct EndedAttempt {
    LeaseId lease;
    std::string worker;
    bool failed = false, for_good = false;
  };

  Record& record(TaskIndex task) { return records_[static_cast<std::size_t>(task)]; }
  const Record& record(TaskIndex task) const { return records_[static_cast<std::size_t>(task)]; }
  bool apply(TaskIndex task, TaskEvent event);
  void count_run(TaskIndex task, bool opened);
  void add_stats(FrameIndex frame, const FrameStats& stats);
  std::int32_t num_needs(TaskIndex task, const BlobRef& output) const;
  std::int32_t num_uses(TaskIndex task, const BlobRef& output) const;
  void count_output(const BlobRef& output, bool made);
  const BlobRef* held_state(TaskIndex task) const;
  std::vector<TaskIndex> held_now() const;
  void force_done(TaskIndex task, const std::vector<BlobRef>& outputs);
  void add_outputs(TaskIndex task, BlobReferences& blobs) const;
  void release_outputs(TaskIndex task, BlobReferences& blobs) const;
  void release_inputs(TaskIndex task, BlobReferences& blobs) const;
  bool stays(TaskIndex task, const BlobRef& output) const;
  void let_go(const std::vector<TaskKey>& renders, BlobReferences& blobs);
  bool lacks_needed_output(TaskIndex task) const;
  std::vector<TaskIndex> ask_inputs_again(TaskIndex task, BlobReferences& blobs) const;
  bool needs_films(TaskIndex task) const;
  void use_cut(TaskIndex task, BlobReferences& blobs) const;
  bool drop_cut(TaskIndex task, BlobReferences& blobs);

  JobGraph graph_;
  Checkpoints checkpoints_;
  bool keep_all_states_, keep_films_;
  std::vector<Record> records_;
  std::vector<std::string> makers_{
      "(not known)"};  ///< names, of at most kMaxWorkers; the first: all others
  std::map<std::string, std::uint16_t> maker_numbers_;
  std::set<TaskIndex> ready_;
  FrameIndex first_open_frame_{0};
  std::vector<std::int32_t> open_renders_;  ///< of each run
  Run first_open_run_{0};
  std::size_t num_held_ = 0;                              ///< of done tasks, needed or not
  std::map<TaskIndex, std::vector<EndedAttempt>> ended_;  ///< and not done
  bool has_failed_ = false;                               ///< some attempt
  std::map<TaskIndex, std::vector<BlobRef>> former_outputs_;
  std::set<FrameIndex> others_frames_;              ///< JobPlan::others_frames
  std::map<TaskIndex, std::vector<BlobRef>> cuts_;  ///< of open tasks: the states they are cut from
  JobProgress progress_;
};

}  // namespace baton
