#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "common/job/task.h"

namespace baton {

/// Watches how long tasks take. A render thread announces its task; the control thread asks which
/// tasks have used up their time, and whether one did not end although it was told to. Safe to use
/// from any thread.
class TaskWatch {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// What a task may take from its end of time to its end, before it counts as stuck.
  static constexpr std::chrono::seconds kStopPatience{30};

  /// A task is watched as long as its mark lives.
  class Mark {
   public:
    /// replay: the command that repeats the task.
    Mark(TaskWatch& watch, const LeaseId& lease, TimePoint deadline, std::string replay = {});
    ~Mark();
    Mark(const Mark&) = delete;
    Mark& operator=(const Mark&) = delete;

   private:
    TaskWatch& watch_;
    const LeaseId lease_;
  };

  struct Overdue {
    LeaseId lease;
    std::string replay;

    bool operator==(const Overdue&) const = default;
  };
  /// The tasks whose deadline has passed; each is named once.
  std::vector<Overdue> take_overdue(TimePoint now);
  /// Whether a task is still in work kStopPatience after its deadline.
  bool is_stuck(TimePoint now) const;

 private:
  struct Entry {
    TimePoint deadline;
    std::string replay;
    bool taken = false;
  };
  mutable std::mutex mutex_;
  std::map<LeaseId, Entry> entries_;
};

}  // namespace baton
