#pragma once

#include <cstdint>
#include <optional>

namespace baton {

/// Where a task stands.
enum class TaskStatus : std::uint8_t {
  blocked,  ///< waits for the outputs of other tasks
  ready,    ///< a worker may have it
  leased,   ///< a worker has it
  done,     ///< its outputs are there
  failed,   ///< given up after too many attempts
  /// No longer wanted, or in need of a task that failed.
  cancelled,
};

/// Whether the task may still be done.
constexpr bool is_open(TaskStatus status) { return status <= TaskStatus::leased; }

/// What can happen to a task.
enum class TaskEvent : std::uint8_t {
  inputs_done,  ///< the last of its inputs is there
  input_lost,   ///< an input that was there is gone
  granted,      ///< leased to a worker
  completed,    ///< the leased attempt reported all outputs
  /// The leased attempt failed or was lost; another one may follow.
  returned,
  /// The leased attempt failed or was lost, and it was the last one.
  exhausted,
  output_lost,  ///< what it made is gone and needed again
  cancelled,
};

/// The only rule by which a status changes:
///
///        ^-----------------------------+
///     blocked <-> ready -> leased -> done
///                   ^---------+----> failed        and from the first three: -> cancelled
///
/// nullopt: the event comes too late or too early and changes nothing. That is normal, not an
/// error.
std::optional<TaskStatus> next_status(TaskStatus status, TaskEvent event);

}  // namespace baton
