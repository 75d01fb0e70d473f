#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "coordinator/schedule/events.h"

namespace baton {

/// What is told of a worker when it asks to be let in.
std::string worker_text(const WorkerHello& hello);

/// Workers that asked to be let in and were not: since when, and why.
class TurnedAway {
 public:
  /// The worker has asked now, and this is why it may not come in. Returns when the same process
  /// asked first.
  TimePoint add(const WorkerHello& hello, const std::string& reason, TimePoint now);
  /// It has come in, or another of its name has.
  void remove(const WorkerHello& hello);

  /// Those that have asked within `age`, the last one first.
  std::vector<AbsentWorker> asked_within(std::chrono::milliseconds age, TimePoint now) const;

 private:
  struct Entry {
    AbsentWorker worker;
    TimePoint first, last;
  };
  std::map<std::uint64_t, Entry> entries_;  ///< by instance
};

}  // namespace baton
