#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/job/farm_event.h"

namespace baton {

/// The words in which a farm answers: what jobs and workers do now, how long that usually takes,
/// and why somebody waits.

/// What a job does. Sent; values are for ever.
enum class JobActivity : std::uint8_t {
  queued = 0,     ///< all workers that could do it are busy
  rendering = 1,  ///< some worker has a task of it
  waiting = 2,    ///< for what no worker can change
  paused = 3,
  done = 4,
  failed = 5,
  cancelled = 6,
};
constexpr JobActivity last_of(JobActivity) { return JobActivity::cancelled; }
/// "queued" ... "cancelled".
std::string_view job_activity_name(JobActivity activity);

/// What a worker does. Sent; values are for ever.
enum class WorkerActivity : std::uint8_t {
  idle = 0,
  rendering = 1,
  draining = 2,  ///< it takes nothing new, and will end
  silent = 3,    ///< no sign of life for two heartbeats
  held = 4,      ///< takes nothing until it is released
};
constexpr WorkerActivity last_of(WorkerActivity) { return WorkerActivity::held; }
/// "idle" ... "held".
std::string_view worker_activity_name(WorkerActivity activity);

/// Why a worker is not here. Sent; values are for ever.
enum class Absence : std::uint8_t {
  lost = 0,         ///< it was silent for too long
  turned_away = 1,  ///< it asked, and may not come in
  left = 2,         ///< it ended in order
};
constexpr Absence last_of(Absence) { return Absence::left; }
/// "lost", "turned away", "left".
std::string_view absence_name(Absence absence);

/// How long tasks take that were done of late, from grant to report.
struct UsualTime {
  double median_s = 0;
  double spread_s = 0;     ///< half the distance between the quartiles
  std::int32_t count = 0;  ///< of tasks; 0: none is known

  bool operator==(const UsualTime&) const = default;
};

/// When a job will be done, in seconds from now: one in ten is by `early_s`, half are by
/// `likely_s`, nine in ten by `late_s`. All 0: that is not known.
struct Eta {
  double early_s = 0, likely_s = 0, late_s = 0;

  bool is_known() const { return late_s > 0; }
  bool operator==(const Eta&) const = default;
};

/// What a job does, and for what it waits, if it does; empty: for nothing.
struct JobNow {
  JobActivity activity = JobActivity::queued;
  std::string reason = {};
  Eta eta = {};

  bool operator==(const JobNow&) const = default;
};

/// One link of the chain from what somebody waits for to its last cause. Sent; values are for ever.
enum class ReasonKind : std::uint8_t {
  // Because of something else in the farm: another link follows.
  input = 0,     ///< the task needs another's result
  order = 1,     ///< earlier frames come first
  busy = 2,      ///< who could do the task has others
  held = 3,      ///< a worker holds a state that it needs
  skipped = 4,   ///< links that are left out
  left_out = 5,  ///< a worker gets no tasks of the job
  // The last cause.
  running = 6,       ///< a worker has the task
  no_worker = 7,     ///< nobody is connected
  renderer = 8,      ///< who is connected renders otherwise
  blind = 9,         ///< nobody sees the job's folders
  tried = 10,        ///< workers have failed the task, or rest
  store = 11,        ///< no room in the store
  disk = 12,         ///< a disk takes nothing
  paused = 13,       ///< by a person, or for want of something
  ended = 14,        ///< the job or the task has ended
  draining = 15,     ///< workers take nothing new
  asking = 16,       ///< a worker is free and will ask for it
  inspecting = 17,   ///< frames are read once more
  no_job = 18,       ///< no job has a task for the worker
  gone = 19,         ///< the worker is not connected
  silent = 20,       ///< a worker says nothing
  turned_away = 21,  ///< the worker may not come in
};
constexpr ReasonKind last_of(ReasonKind) { return ReasonKind::turned_away; }
/// "input" ... "turned away".
std::string_view reason_kind_name(ReasonKind kind);
/// Whether no other link explains it.
constexpr bool is_last(ReasonKind kind) { return kind >= ReasonKind::running; }

struct Reason {
  ReasonKind kind = ReasonKind::input;
  std::string text = {};  ///< a clause, for people
  JobId job = {};         ///< whose task, or which; empty: none
  bool has_task = false;
  TaskPlace task = {};
  std::vector<std::string> workers = {};
  double seconds = 0;         ///< so long already; 0: not known
  UsualTime usual = {};       ///< of the task
  std::int64_t since_ms = 0;  ///< since 1970, UTC; 0: not known
  std::uint64_t need_bytes = 0, free_bytes = 0;

  bool operator==(const Reason&) const = default;
};

}  // namespace baton
