#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "coordinator/schedule/attempt_book.h"
#include "coordinator/schedule/blob_ledger.h"
#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_graph.h"
#include "coordinator/schedule/output_book.h"
#include "coordinator/schedule/task_book.h"

namespace baton {

/// What people are shown of a job.
struct JobProgress {
  std::uint64_t tasks_total = 0, tasks_done = 0, tasks_leased = 0, tasks_failed = 0;
  std::uint64_t tasks_open = 0;     ///< blocked, ready or leased
  std::uint64_t attempts_lost = 0;  ///< failed attempts and lost leases
  std::uint32_t frames_done = 0;
  std::uint64_t state_bytes = 0, state_pixels = 0;
};

/// All tasks of one job: where they stand, what they made, who needs that and what went wrong, each
/// in a book of its own. A verb here is what happens to a task, and changes all books at once;
/// whoever wants to know something asks the book. Workers are only names.
class JobTasks {
 public:
  explicit JobTasks(const JobSpec& spec);

  const JobGraph& graph() const { return graph_; }
  const TaskBook& book() const { return book_; }
  const OutputBook& made() const { return made_; }
  const BlobLedger& ledger() const { return ledger_; }
  const AttemptBook& attempts() const { return attempts_; }
  AttemptBook& attempts() { return attempts_; }
  JobView view() const { return {graph_, book_, made_}; }
  JobProgress progress() const;
  /// What the tasks counted, as workers reported it.
  const RenderStats& stats() const { return stats_; }
  /// The same of each frame, over the tiles and sweeps so far.
  const std::map<FrameIndex, FrameStats>& frames() const { return frames_; }

  /// Takes up what an earlier coordinator recorded as done, in any order; of a fresh job only.
  /// Tasks that are none of the job's are left out. gone: spare blobs that are not there. A task
  /// that is recorded without outputs, or without the films of a cut, is opened again if an open
  /// task takes what it lacks, and so on back to what is there or can be cut. Returns those that
  /// were.
  std::vector<TaskIndex> restore(const Completions& completions, const std::vector<BlobRef>& gone,
                                 BlobReferences& blobs, const JobPlan& plan = {});
  /// What a task made before the restored ones: it must come out alike.
  void remember(const Completions::Task& former);
  /// Leases a ready task. Returns the number of the attempt, from 1.
  std::uint32_t grant(TaskIndex task) { return book_.grant(graph_, task); }
  /// Leases a ready task once more by an attempt that was granted before.
  void take_up(TaskIndex task) { book_.take_up(graph_, task); }
  /// Ends a leased task: its outputs must be complete and sorted (JobGraph::check_outputs).
  /// Releases its dependents, and the blobs that nobody needs any more. is_shared: other workers
  /// may read its state.
  void complete(TaskIndex task, const Completion& completion, const std::string& worker,
                bool is_shared, BlobReferences& blobs);
  /// Ends an open assembly, which is not leased to anybody: its frame counts as made, whatever is
  /// in the file.
  Completion leave_frame(TaskIndex task, BlobReferences& blobs);
  /// A state that the worker holds is in the store now. nullopt: it does not hold it; else the task
  /// that made it.
  std::optional<TaskIndex> publish(const PublishedState& state, const std::string& worker,
                                   BlobReferences& blobs);
  /// Opens a leased task again: ready, or blocked when an input was lost meanwhile.
  void give_back(TaskIndex task);
  /// What a done task made is gone: it is done again, and so is whatever it needs and nobody kept,
  /// as far back as that goes. A task that is not done, but is a cut, is rendered instead. Returns
  /// those that were done.
  std::vector<TaskIndex> reopen(TaskIndex task, BlobReferences& blobs);
  /// All that open tasks would take films of is done again, since they will be rendered otherwise,
  /// and what is done leaves no films to be added to. Returns what is done again. Nothing may be
  /// leased.
  std::vector<TaskIndex> reopen_unfinished(BlobReferences& blobs);
  /// Ends a leased task for good, and cancels what cannot be done without it. Returns what was
  /// leased of that: an input of it was lost meanwhile.
  std::vector<TaskIndex> give_up(TaskIndex task);
  /// Cancels whatever is open.
  void cancel_open();
  /// Remembers a failed attempt. From now on nothing is held, so nothing stays between checkpoints.
  void add_failure(TaskIndex task, const Failure& failure, BlobReferences& blobs);
  /// The worker reads the task's inputs: those of others stay until the next checkpoint.
  void share_inputs(TaskIndex task, const std::string& worker, BlobReferences& blobs) {
    ledger_.share_inputs(view(), task, worker, blobs);
  }
  /// Nothing between checkpoints stays for a worker that may be lost, now or later.
  void let_between_go(BlobReferences& blobs) { ledger_.let_between_go(view(), blobs); }
  /// Forgets every blob, of a job that is to be replaced.
  void release_all(BlobReferences& blobs) { ledger_.release_all(view(), blobs); }

 private:
  void force_done(TaskIndex task, const std::vector<BlobRef>& outputs);

  JobGraph graph_;
  TaskBook book_;
  OutputBook made_;
  BlobLedger ledger_;
  AttemptBook attempts_;
  RenderStats stats_;
  std::map<FrameIndex, FrameStats> frames_;
  std::set<FrameIndex> others_frames_;  ///< JobPlan::others_frames
};

}  // namespace baton
