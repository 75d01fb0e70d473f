#pragma once

#include <cstdint>
#include <span>

#include "coordinator/schedule/blob_sizes.h"
#include "coordinator/schedule/task_book.h"

namespace baton {

/// What the store holds, against its limit. Tasks add states and films, and only assembly and later
/// frames take them away; between runs a job's last states stay. So that what may be begun is
/// finished,
/// - a task is granted when there is room for what it makes,
/// - a run is begun when there is room for all of it beside what is begun of others,
/// - a job is begun beside others when, in some order, all can end one after the other.
/// Sizes of what is not made are those of what was, and frames may be wanted once more: where rooms
/// fall short, runs that were begun may take an eighth of the limit more, and if that is too little
/// for all of them, the farm ends one after the other, task by task.
struct StoreRoom {
  std::uint64_t limit = 0;     ///< 0: none
  std::uint64_t used = 0;      ///< by blobs that somebody needs
  std::uint64_t expected = 0;  ///< that tasks in work will add
  std::uint64_t kept = 0;      ///< of `used`, by jobs that have ended
  bool is_idle = true;         ///< no task is in work

  /// Whether the store takes so much more, beside what tasks in work will add.
  bool fits(std::uint64_t more_bytes) const {
    return limit == 0 || used + expected + more_bytes <= limit;
  }
};

/// An open job, as far as it fills the store.
struct JobInStore {
  const JobSpec& spec;
  const JobGraph& graph;
  const TaskBook& book;
  const BlobSizes& sizes;
  /// The one after the last of which a task was granted.
  Run begun_runs;
  /// It is not paused, and somebody renders as it was begun.
  bool may_go_on = true;
  /// It has begun again for others, and waits until nobody is begun.
  bool yields = false;
};

/// What the open tasks of the runs before `end` will add to the store, their second passes
/// included.
std::uint64_t unmade_bytes(const JobInStore& job, Run end);
/// What the store must take so that the frames of a task can be written, or the task.
std::uint64_t needed_bytes(const JobInStore& job, TaskIndex task);

/// What the open tasks of the runs that are in work will add.
std::uint64_t begun_bytes(const JobInStore& job);

/// Whether a task may be granted; if not, what it waits for, least first.
enum class Room : std::uint8_t {
  enough,
  beside,      ///< other jobs must end before it
  too_little,  ///< other runs must end
};
/// task: a ready one. others: the other open jobs. before: what jobs that come before this one wait
/// for. While some are in work, no run is begun where such a job waits for runs to end, and no job
/// where it waits for jobs.
Room room_for(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others,
              TaskIndex task, Room before);

}  // namespace baton
