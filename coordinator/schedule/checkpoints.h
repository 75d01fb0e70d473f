#pragma once

#include <cstdint>
#include <vector>

#include "common/job/task.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {

/// Which states stay although all who need them have read them, so that what is lost later is made
/// again from there and not from the first frame. A *checkpoint* is the state of every
/// state.checkpointEvery-th frame; it stays until the two after it, or those that there are, are
/// complete: of the tile itself where pixels keep to themselves, else of all tiles. What is
/// *between* two checkpoints stays until the second of them is complete: with it a worker that is
/// lost takes only what it has made itself since the first. The states of the last run stay for a
/// job of more frames. Once let go a state is never asked for again.
class Checkpoints {
 public:
  explicit Checkpoints(const JobGraph& graph);

  /// Whether the state of a render task is such a checkpoint.
  bool keeps(const TaskKey& render) const;
  /// Whether it is at a checkpoint, or a result; else it is between two.
  bool is_checkpoint(const TaskKey& render) const {
    const std::int32_t end = render.run().value() + 1;
    return end == num_runs_ || end % runs_per_stage_ == 0;
  }
  /// Whether it is between two of which the second is not complete.
  bool keeps_between(const TaskKey& render) const;
  /// A render task is done. Returns those whose states need not stay any more.
  std::vector<TaskKey> complete(const TaskKey& render);
  /// A render task that was done is open again.
  void reopen(const TaskKey& render);
  /// The state of a render task is gone, and with it the use of the checkpoint, or of what is
  /// between the same two.
  void let_go(const TaskKey& render);
  /// All that is between checkpoints, now and later, need not stay. Returns those that did.
  std::vector<TaskKey> let_between_go();

 private:
  /// The runs up to a checkpoint of the tiles that share it.
  struct Stage {
    std::int32_t open = 0;        ///< render tasks that are not done
    bool let_go = false;          ///< its checkpoint
    bool between_let_go = false;  ///< the states before it
  };
  std::size_t stage_of(const TaskKey& render) const;
  bool is_over(std::size_t stage) const;
  void let_between_go(std::size_t stage, std::vector<TaskKey>& gone);

  std::int32_t runs_per_stage_, num_runs_, num_tiles_;
  /// A row of stages: from one checkpoint to the next, those of all tiles.
  std::size_t tiles_per_stage_, stages_per_row_;
  std::vector<Stage> stages_;  ///< by row, then tile
};

}  // namespace baton
