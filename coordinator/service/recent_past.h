#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/activity.h"
#include "common/protocol/messages.h"

namespace baton {

/// What people often ask of the past, in memory: how long tasks take, who was lost, who changed a
/// job last. It is told every event, in the order of time.
class RecentPast {
 public:
  /// Tasks of a kind and job whose times are kept, the newest.
  static constexpr std::size_t kMostTimes = 32;
  /// The events that count.
  static std::uint64_t kinds();

  void add(const FarmEvent& event);

  /// Of tasks of the kind and job that were done of late.
  UsualTime usual(const JobId& job, TaskKind kind) const;
  /// The event that last changed the job's status; nullptr: none is known.
  const FarmEvent* last_change(const JobId& job) const;
  /// Workers that were lost at this time or later and have not come again, the newest first.
  std::vector<AbsentWorker> lost(std::int64_t since_ms) const;
  /// What became of a worker that was lost or has left; nullptr: it is here, or not known.
  const AbsentWorker* absent(const std::string& worker) const;
  /// Whether a worker is to take nothing new; that stays so where it comes again, but for one that
  /// has ended in order.
  bool is_held(const std::string& worker) const { return held_.contains(worker); }
  /// Since when nobody is connected, as far as it is known; 0: it is not, or somebody is.
  std::int64_t alone_since_ms() const { return connected_.empty() ? alone_since_ms_ : 0; }

 private:
  static constexpr std::size_t kMostAbsent = 1000;
  void end_worker(const FarmEvent& event);

  std::map<JobId, std::array<std::deque<double>, 3>> times_;  ///< by TaskKind
  std::map<JobId, FarmEvent> changes_;
  struct Arrival {
    std::int64_t time_ms = 0;
    std::string about = {};
    bool is_draining = false;
  };
  std::map<std::string, Arrival> connected_;
  std::set<std::string> held_;
  std::map<std::string, AbsentWorker> absent_;
  std::int64_t alone_since_ms_ = 0;
};

}  // namespace baton
