#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/protocol/messages.h"

namespace baton {

/// Tells on stderr how a job gets on: one line that is rewritten on a terminal, a line now and then
/// elsewhere.
class Progress {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit Progress(bool terminal) : terminal_(terminal) {}

  /// eta: as the farm has it.
  void update(const JobSummary& job, const Eta& eta, TimePoint now);
  /// Leaves the line, so that other output starts on a new one.
  void finish();

  /// "frames 12/48  tasks 340/2160  3.2 frames/s  ETA 12s (10s to 15s)". Rates count what was done
  /// since the first update, so that a resumed job does not look faster than it is.
  std::string line(const JobSummary& job, const Eta& eta, TimePoint now) const;

 private:
  struct Start {
    TimePoint time;
    std::uint64_t tasks_done = 0;
    std::uint32_t frames_done = 0;
  };

  bool terminal_ = false;
  bool line_open_ = false;
  std::optional<Start> start_;
  std::optional<TimePoint> last_shown_;
};

}  // namespace baton
