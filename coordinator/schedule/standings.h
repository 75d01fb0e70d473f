#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "coordinator/schedule/events.h"

namespace baton {

/// How workers stand with one job: who has failed much of it, who does not see its folders. Both
/// pass with time, or when the worker is started anew.
class Standings {
 public:
  /// How long a worker rests from a job of whose tasks it has failed max_failures_per_worker, while
  /// another is there that does not.
  static constexpr std::chrono::minutes kWorkerRest{10};
  /// How long a worker gets nothing of a job whose folders it cannot see; then it looks again.
  static constexpr std::chrono::minutes kBlindRest{1};

  void add_failure(const std::string& worker, std::int32_t max_failures, TimePoint now);
  void add_blind(const std::string& worker, const std::string& unseen, TimePoint now);
  void forget(const std::string& worker);
  /// Folders that were not seen may be there now.
  void forget_blind() { blind_.clear(); }

  bool has_failed_much(const std::string& worker, TimePoint now) const;
  bool is_blind(const std::string& worker, TimePoint now) const;
  /// A folder that some worker did not see; empty: none said so.
  std::string unseen() const { return blind_.empty() ? "" : blind_.begin()->second.unseen; }
  /// The one that this worker did not see; empty: it said nothing.
  std::string unseen_by(const std::string& worker) const;

 private:
  struct Failed {
    std::int32_t failures = 0;  ///< since its last rest
    TimePoint rests_until{};
  };
  struct Blind {
    std::string unseen;
    TimePoint until;
  };
  std::map<std::string, Failed> failed_;
  std::map<std::string, Blind> blind_;
};

}  // namespace baton
