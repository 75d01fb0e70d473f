#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "jobs/trace/played_trace.h"
#include "jobs/trace/trace_file.h"

namespace baton {

/// What a trace says in short.
struct TraceSummary {
  /// From the first span to the end of the last.
  double seconds = 0;
  std::size_t threads = 0;  ///< those that had tasks
  std::size_t workers = 0;
  /// Threads with a task that did not wait, the mean.
  double busy = 0;
  double lead_s = 0, tail_s = 0;  ///< before the first task and after the last
  BusyOverTime busy_over_time = {};
  /// Thread seconds by what was done or waited for, the greatest first.
  std::vector<std::pair<std::string, double>> done, waited;
  /// On so many threads of one worker, by list scheduling.
  std::vector<std::pair<std::size_t, Playback>> played;
  /// With a thread for all that goes at a time.
  Playback without_limit;
};

/// threads: which numbers of threads to play it on.
TraceSummary summarize(const Trace& trace, const std::vector<std::size_t>& threads);
/// Lines for people.
std::string summary_text(const TraceSummary& summary);
nlohmann::ordered_json summary_json(const TraceSummary& summary);

}  // namespace baton
