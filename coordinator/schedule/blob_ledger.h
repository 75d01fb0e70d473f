#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "coordinator/schedule/blob_references.h"
#include "coordinator/schedule/checkpoints.h"
#include "coordinator/schedule/events.h"
#include "coordinator/schedule/output_book.h"
#include "coordinator/schedule/task_book.h"

namespace baton {

/// What is known of a job's tasks, read together.
struct JobView {
  const JobGraph& graph;
  const TaskBook& tasks;
  const OutputBook& made;
};

/// Who needs which blob of a job: tasks that take it as input, the job's result, what may be lost
/// later (Checkpoints). Every verb keeps the needs of all jobs (BlobReferences) in step. Images are
/// files of the output folder, not blobs of the store.
class BlobLedger {
 public:
  BlobLedger(const JobSpec& spec, const JobGraph& graph);

  /// Whether the task, which is not done, is a Cut.
  bool is_cut(TaskIndex task) const { return cuts_.contains(task); }
  /// The blobs that the task needs: see LeaseGrant in PROTOCOL.md. It must have its inputs, or be
  /// a cut.
  std::vector<BlobRef> inputs(const JobView& job, TaskIndex task) const;
  /// Whether an open task or the job's result needs an output of a done task.
  bool is_needed(const JobView& job, TaskIndex task, const BlobRef& output) const;
  /// Those of what the task made.
  std::vector<BlobRef> live_blobs(const JobView& job, TaskIndex task) const;
  /// Those that stay only for what may be lost, or come after the job.
  std::vector<BlobRef> spare_blobs(const JobView& job, TaskIndex task) const;
  /// Whether the state of a render task is a result, or a checkpoint that stays.
  bool keeps_state(const TaskKey& render) const {
    return keep_all_states_ || checkpoints_.keeps(render);
  }
  /// Whether an open task takes what a done one does not have.
  bool lacks_needed_output(const JobView& job, TaskIndex task) const;

  /// These tasks were done before, with cuts among those that are open. gone: spare blobs that are
  /// not there.
  void restore(const JobView& job, const std::vector<TaskIndex>& done,
               const std::vector<BlobRef>& gone, const std::vector<Cut>& cuts,
               BlobReferences& blobs);
  /// Tasks that are done are no cuts.
  void forget_done_cuts(const JobView& job);
  /// The task is done now: it needs its inputs no more, and others need its outputs. is_shared:
  /// other workers may read its state.
  void complete(const JobView& job, TaskIndex task, bool is_shared, BlobReferences& blobs);
  /// The task is to be opened again: nobody needs its outputs.
  void reopen(const JobView& job, TaskIndex task, BlobReferences& blobs);
  /// A task that was opened again needs its inputs, or what it is cut from. Returns the inputs that
  /// are done, but have lost a blob that it takes.
  std::vector<TaskIndex> need_inputs(const JobView& job, TaskIndex task, BlobReferences& blobs);
  /// An open task that is a cut is rendered instead. Returns as need_inputs; a task that is no cut
  /// does not change.
  std::vector<TaskIndex> drop_cut(const JobView& job, TaskIndex task, BlobReferences& blobs);
  /// The worker reads the task's inputs: those of others stay until the next checkpoint.
  void share_inputs(const JobView& job, TaskIndex task, const std::string& worker,
                    BlobReferences& blobs);
  /// Between these two the outputs of a task are replaced, by ones that all workers may read.
  void release_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const;
  void add_shared_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs);
  /// Nothing between checkpoints stays for a worker that may be lost, now or later.
  void let_between_go(const JobView& job, BlobReferences& blobs);
  /// What is done so far leaves no films to what comes after the job.
  void let_films_go(const JobView& job, BlobReferences& blobs);
  /// Forgets every blob, of a job that is to be replaced.
  void release_all(const JobView& job, BlobReferences& blobs);

 private:
  struct Record {
    bool is_shared = true;  ///< other workers may read its state
    /// They are not all there, and nobody counts on them.
    bool films_let_go = false;
  };
  Record& record(TaskIndex task) { return records_[static_cast<std::size_t>(task)]; }
  const Record& record(TaskIndex task) const { return records_[static_cast<std::size_t>(task)]; }
  std::int32_t num_needs(const JobView& job, TaskIndex task, const BlobRef& output) const;
  std::int32_t num_uses(const JobView& job, TaskIndex task, const BlobRef& output) const;
  bool stays(const JobView& job, TaskIndex task, const BlobRef& output) const;
  void add_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const;
  void release_inputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const;
  bool needs_films(const JobView& job, TaskIndex task) const;
  void use_cut(TaskIndex task, BlobReferences& blobs) const;
  bool release_cut(TaskIndex task, BlobReferences& blobs);
  std::vector<TaskIndex> ask_inputs(const JobView& job, TaskIndex task,
                                    BlobReferences& blobs) const;
  void let_go(const JobView& job, const std::vector<TaskKey>& renders, BlobReferences& blobs);

  Checkpoints checkpoints_;
  bool keep_all_states_, keep_films_;
  std::vector<Record> records_;
  /// By open task: the states that it is cut from.
  std::map<TaskIndex, std::vector<BlobRef>> cuts_;
};

}  // namespace baton
