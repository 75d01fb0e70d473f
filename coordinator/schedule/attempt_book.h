#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {

/// How a worker failed a task.
struct Blame {
  std::int32_t failures = 0;
  /// It said that no retry of its own can help.
  bool for_good = false;
  std::string message = {};  ///< of the last failure, its first line
};

/// Which attempts at the tasks of a job have come to nothing, and through whom.
class AttemptBook {
 public:
  /// Remembers a failed attempt.
  void add_failure(TaskIndex task, const Failure& failure);
  /// Remembers an attempt that was reported as not done and is nobody's failure.
  void add_returned(TaskIndex task, const LeaseId& lease, const std::string& worker);
  /// Remembers a lost lease. Returns how many the task has lost.
  std::int32_t add_loss(TaskIndex task);
  /// The worker was started anew: what it could not do for good, it may try once more.
  void forgive(const std::string& worker);
  void forget_losses() { losses_.clear(); }

  /// Failed attempts and lost leases.
  std::uint64_t num_lost() const { return num_lost_; }
  bool has_failed() const { return has_failed_; }
  /// Whether this very attempt was reported as not done: it cannot be taken up again.
  bool has_ended(TaskIndex task, const LeaseId& lease) const;
  /// The tasks of which an attempt was reported as not done.
  std::vector<TaskIndex> tried() const;
  /// How often each worker failed the task.
  std::map<std::string, Blame> blame(TaskIndex task) const;

 private:
  struct Ended {
    LeaseId lease;
    std::string worker;
    bool failed = false, for_good = false;
    std::string message = {};
  };
  std::map<TaskIndex, std::vector<Ended>> ended_;
  std::map<TaskIndex, std::int32_t> losses_;
  std::uint64_t num_lost_ = 0;
  bool has_failed_ = false;
};

}  // namespace baton
