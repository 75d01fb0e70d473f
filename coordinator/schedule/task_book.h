#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "coordinator/schedule/job_graph.h"
#include "coordinator/schedule/task_status.h"

namespace baton {

/// How many tasks of a job stand where.
struct TaskCounts {
  std::uint64_t total = 0, done = 0, leased = 0, failed = 0;
  std::uint64_t open = 0;  ///< blocked, ready or leased
};

/// Where each task of a job stands, by next_status alone, and what follows from that: which are
/// ready, what is the first that is not done.
class TaskBook {
 public:
  explicit TaskBook(const JobGraph& graph);

  TaskStatus status(TaskIndex task) const { return record(task).status; }
  const TaskCounts& counts() const { return counts_; }
  /// Tasks that a worker may have, in the order in which they should be granted.
  const std::set<TaskIndex>& ready() const { return ready_; }
  /// Whether all tasks that it needs are done. A leased task may lose one of them.
  bool has_inputs(TaskIndex task) const { return record(task).missing_inputs == 0; }
  /// The first frame that is not written and may still be; num_frames: there is none.
  FrameIndex first_open_frame() const { return first_open_frame_; }
  /// The first run with an open render task; num_runs: there is none.
  Run first_open_run() const { return first_open_run_; }
  /// Render tasks of the run that are open.
  std::int32_t num_open_renders(Run run) const { return open_renders_[run.index()]; }

  /// The only place that writes a status. False: the event comes too late or too early, and changes
  /// nothing.
  bool apply(const JobGraph& graph, TaskIndex task, TaskEvent event);
  /// Leases a ready task. Returns the number of the attempt, from 1.
  std::uint32_t grant(const JobGraph& graph, TaskIndex task);
  /// Leases a ready task once more by an attempt that was granted before.
  void take_up(const JobGraph& graph, TaskIndex task);
  /// How often it was granted.
  std::uint32_t attempts(TaskIndex task) const { return record(task).attempts; }
  /// An input of the task is done: with the last one it is ready.
  void add_input(const JobGraph& graph, TaskIndex task);
  /// An input of the task is not done any more.
  void take_input(const JobGraph& graph, TaskIndex task);

 private:
  struct Record {
    TaskStatus status = TaskStatus::blocked;
    /// Input tasks that are not done, whatever its own status.
    std::int32_t missing_inputs = 0;
    std::uint32_t attempts = 0;
  };
  Record& record(TaskIndex task) { return records_[static_cast<std::size_t>(task)]; }
  const Record& record(TaskIndex task) const { return records_[static_cast<std::size_t>(task)]; }
  void count(TaskStatus status, std::uint64_t change);
  void count_run(const JobGraph& graph, TaskIndex task, bool opened);

  std::vector<Record> records_;
  std::set<TaskIndex> ready_;
  std::vector<std::int32_t> open_renders_;  ///< by run
  FrameIndex first_open_frame_{0};
  Run first_open_run_{0};
  TaskCounts counts_;
};

/// The first step that is not done: not rendered, or in the last sweep not written.
Step first_open_step(const JobGraph& graph, const TaskBook& book);
/// States of earlier steps than this are inputs of no open task.
Step states_from(const JobGraph& graph, const TaskBook& book);

}  // namespace baton
