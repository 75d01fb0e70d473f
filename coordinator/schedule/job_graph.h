#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/job/job_spec.h"
#include "common/job/plan/sequence.h"
#include "common/job/plan/timeline.h"
#include "common/job/task.h"

namespace baton {

/// Position of a task in its job: first the assemble tasks by frame, then the second-pass tasks by
/// step and tile, if there is a second pass, then the render tasks by run and tile. This is also
/// the order in which ready tasks are granted: frames are finished before new ones are begun.
using TaskIndex = std::int32_t;

/// Number of tasks of a job, before anything is allocated for it.
std::int64_t count_tasks(const JobSpec& job);

/// The task graph of a job, by arithmetic: nothing is stored per task, and of a run its first
/// step.
///
/// If the job carries state, render(run, tile) needs render(run - 1, t) of every tile t that
/// history may come from: itself, and its neighbours within history_reach_px. In a later sweep it
/// needs the films of its tile of the sweep before.
/// second_pass(step, tile) needs the render tasks of that step of all tiles within
/// exchange_reach_px; jobs with a second pass have one sweep. assemble(frame) needs all tiles of
/// its run in the last sweep, or all its second passes.
class JobGraph {
 public:
  /// count_tasks(job) must be at most limits::kMaxTasksPerJob.
  explicit JobGraph(const JobSpec& job);

  TaskIndex num_tasks() const { return first_render_ + num_runs() * num_tiles_; }
  std::int32_t num_frames() const { return timeline_.num_frames(); }
  std::int32_t num_tiles() const { return num_tiles_; }
  std::int32_t num_runs() const { return timeline_.num_runs(); }
  const Timeline& timeline() const { return timeline_; }

  /// nullopt: the job has no such task.
  std::optional<TaskIndex> find(const TaskKey& key) const;
  /// The inverse of find; index in [0, num_tasks()).
  TaskKey key(TaskIndex index) const;

  /// Number of tasks that must be done before this one is ready.
  std::int32_t num_inputs(const TaskKey& key) const;
  /// The tasks that need this one.
  std::vector<TaskIndex> dependents(const TaskKey& key) const;
  /// The tasks that this one needs, in tile order.
  std::vector<TaskIndex> inputs(const TaskKey& key) const;

  /// The steps that a render task or a second pass works on.
  StepSpan steps(const TaskKey& key) const;

  /// Whether a render task hands its samples to the next run.
  bool carries_state() const { return carries_state_; }
  /// Whether a render task needs states of other tiles than its own.
  bool shares_history() const { return shares_history_; }
  bool has_second_pass() const { return has_second_pass_; }
  /// Runs in state.checkpointEvery frames.
  std::int32_t runs_per_checkpoint() const { return runs_per_checkpoint_; }
  /// Pixels of a tile.
  std::uint64_t num_pixels(std::int32_t tile) const;

  /// What of a render task must be there.
  enum class Extent {
    all,
    /// Its films are not needed: its state is a Cut.
    state,
  };
  /// Sorts the outputs that a task reported: state first, then films by step. nullopt when they
  /// are exactly what the task must make; else what is wrong with them.
  std::optional<std::string> check_outputs(const TaskKey& key, std::vector<BlobRef>& outputs,
                                           Extent extent = Extent::all) const;
  /// nullopt when the statistics are of the task's own tile and steps or frame, each once at most;
  /// else what is wrong.
  std::optional<std::string> check_frames(const TaskKey& key,
                                          const std::vector<FrameStats>& frames) const;
  /// How many blobs of a kind the task makes.
  std::int32_t num_outputs(const TaskKey& key, BlobKind kind) const;
  /// What `reader` takes of `maker`, one of its inputs: positions in the sorted outputs of `maker`.
  std::vector<std::size_t> taken_outputs(const TaskKey& reader, const TaskKey& maker) const;
  /// Whether `reader`, one of its dependents, takes an output of `maker`.
  bool takes(const TaskKey& reader, const TaskKey& maker, const BlobRef& output) const;

 private:
  TaskIndex render_index(Run run, std::int32_t tile) const;
  TaskIndex second_pass_index(Step step, std::int32_t tile) const;
  std::vector<BlobRef> expected_outputs(const TaskKey& key) const;
  void add_neighbours(Run run, std::int32_t tile, std::vector<TaskIndex>& tasks) const;
  void add_renders_of(const StepSpan& steps, std::int32_t tile,
                      std::vector<TaskIndex>& tasks) const;

  TileGrid grid_;
  Timeline timeline_;
  std::int32_t num_tiles_, runs_per_checkpoint_, reach_px_;
  bool carries_state_, shares_history_, has_second_pass_;
  std::int32_t exchange_reach_px_;
  TaskIndex first_render_;
};

}  // namespace baton
