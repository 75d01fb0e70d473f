#pragma once

#include <cstdint>
#include <span>

#include "coordinator/schedule/blob_sizes.h"
#include "coordinator/schedule/task_book.h"

namespace baton {

/// What the store holds, against its limit. Tasks add states and films, and only assembly and later
/// frames take them away. So what may be begun is finished: a run of frames is begun when there is
/// room for all of it beside all runs that were begun, and a task is granted when there is room for
/// what it makes. Sizes of what is not made are those of what was: where they fall short, runs that
/// were begun may take an eighth of the limit more, and if that is too little for all of them, one
/// after the other ends, task by task.
struct StoreRoom {
  std::uint64_t limit = 0;     ///< 0: none
  std::uint64_t used = 0;      ///< by blobs that somebody needs
  std::uint64_t expected = 0;  ///< that tasks in work will add
  bool is_idle = true;         ///< no task is in work

  /// Whether the store takes so much more, beside what tasks in work will add.
  bool fits(std::uint64_t more_bytes) const {
    return limit == 0 || used + expected + more_bytes <= limit;
  }
};

/// An open job, as far as it fills the store.
struct JobInStore {
  const JobGraph& graph;
  const TaskBook& book;
  const BlobSizes& sizes;
  /// The one after the last of which a task was granted.
  Run begun_runs;
};

/// What the open tasks of the runs before `end` will add to the store, second passes of frames that
/// are not written included.
std::uint64_t unmade_bytes(const JobInStore& job, Run end);
/// What the store must take so that a task's run ends: all of the run that is not made, or the
/// task.
std::uint64_t needed_bytes(const JobInStore& job, TaskIndex task);
/// Whether a ready task may be granted. others: the other open jobs. others_wait: a job that comes
/// before this one waits for room, so no run is begun.
bool has_room(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others,
              TaskIndex task, bool others_wait);

}  // namespace baton
