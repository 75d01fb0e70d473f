#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/job/job_id.h"
#include "common/job/task.h"
#include "common/job/time.h"

namespace baton {

/// What a coordinator's history is made of: each thing that happened is told once.

/// Stored and sent; values are for ever.
enum class FarmEventKind : std::uint8_t {
  coordinator_started = 0,
  coordinator_stopped = 1,
  job_submitted = 2,
  job_changed = 3,  ///< has a new version
  job_resumed = 4,
  job_paused = 5,
  job_done = 6,
  job_failed = 7,
  job_cancelled = 8,
  job_deleted = 9,
  task_granted = 10,
  task_done = 11,
  task_failed = 12,
  task_returned = 13,  ///< not done, and nobody's failure
  task_lost = 14,      ///< its worker or its result is gone
  task_revoked = 15,   ///< nobody needs it any more
  tasks_reopened = 16,
  worker_joined = 17,
  worker_left = 18,
  worker_lost = 19,  ///< silent for too long
  worker_drained = 20,
  frames_locked = 21,
  frames_unlocked = 22,
  priority_changed = 23,
  worker_held = 24,  ///< takes nothing new until it is released
  worker_released = 25,
  frames_requeued = 26,  ///< somebody wants them rendered once more
};
constexpr FarmEventKind last_of(FarmEventKind) { return FarmEventKind::frames_requeued; }
/// "coordinator started" ... "frames requeued".
std::string_view farm_event_name(FarmEventKind kind);

/// A task as people see it: which frames, which tile.
struct TaskPlace {
  TaskKind kind = TaskKind::render;
  FrameNumber first{}, last{};
  std::int32_t tile = 0;
  std::uint32_t attempt = 0;

  bool operator==(const TaskPlace&) const = default;
};
/// "frames 9-12, tile 3", "frame 9, tile 3, second pass", "frame 9": an assembly.
std::string place_text(const TaskPlace& place);

struct FarmEvent {
  std::int64_t sequence = 0;  ///< from 1, in the order of time
  std::int64_t time_ms = 0;   ///< since 1970, UTC
  FarmEventKind kind = FarmEventKind::coordinator_started;
  /// Who did it: a key's name, or a worker's; empty: the coordinator itself, or somebody without a
  /// key.
  std::string actor = {};
  JobId job = {};  ///< empty: it is about no job
  bool has_task = false;
  TaskPlace task = {};
  std::string worker = {};
  std::string reason = {};
  /// How long what ended took: a task since it was granted, a job since it was started.
  double seconds = 0;

  bool operator==(const FarmEvent&) const = default;
};

/// Which events are wanted.
struct EventQuery {
  JobId job = {};                   ///< empty: of all
  std::int64_t after_sequence = 0;  ///< later ones
  std::int64_t since_ms = 0;        ///< at this time or later
  std::int32_t count = 1000;        ///< at most so many
  bool is_newest = true;            ///< the newest of them; else the oldest
  std::uint64_t kinds = 0;          ///< a bit for each kind; 0: all
};
constexpr std::uint64_t bit_of(FarmEventKind kind) {
  return std::uint64_t{1} << static_cast<unsigned>(kind);
}

}  // namespace baton
