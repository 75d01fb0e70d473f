#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "jobs/trace/trace_file.h"

namespace baton {

/// What several tasks need and one makes, such as the light of a frame.
struct SharedWork {
  std::string name;
  double alone_s = 0;   ///< that one thread does
  double shared_s = 0;  ///< that all who wait for it do together
};

/// A task as it can be played again.
struct PlayedTask {
  /// Something to do, once works are there.
  struct Piece {
    std::vector<std::size_t> works;  ///< needed before
    double seconds = 0;              ///< that its thread does alone
    /// What it then does together with threads that have nothing to do.
    std::size_t parts = 0;
    double part_s = 0;
  };
  std::string kind;  ///< task_name()
  double began_s = 0;
  std::vector<Piece> pieces;
  std::vector<std::size_t> after;  ///< tasks whose results it needs
  /// From its end until others may use what it has made.
  double publish_s = 0;
};

/// The tasks of a trace with what they wait for: what a machine with another number of threads
/// would have to do. Times are those that threads were busy: CPU time, and where they read or wrote
/// the time that this took.
struct PlayedTrace {
  std::vector<SharedWork> works;
  std::vector<PlayedTask> tasks;  ///< in the order of their starts
  /// Before the first task and after the last, in which nobody has a task.
  double lead_s = 0, tail_s = 0;

  /// Busy time of all tasks and works.
  double work_s() const;
};

/// Takes a trace apart. Tasks that were lost are left out, of those that were done again the last
/// counts. Works of the frames that several processes have made count once, with their mean.
PlayedTrace take_apart(const Trace& trace);

/// Busy threads in equal stretches of time, their means.
struct BusyOverTime {
  static constexpr std::size_t kSlices = 60;
  std::vector<double> threads = std::vector<double>(kSlices, 0.0);

  /// So many more are busy for a time. whole_s: how long all of it takes.
  void add(double whole_s, double from_s, double to_s, double count = 1);
};

/// How it goes on so many threads of one process.
struct Playback {
  double seconds = 0;  ///< lead and tail included
  double busy = 0;     ///< threads, the mean
  BusyOverTime busy_over_time = {};
  /// The chain of tasks that ends last: busy seconds by kind, and those in which it waited for
  /// works, by what these are, without their numbers.
  std::map<std::string, double> chain_s, chain_waits_s;
  std::size_t chain_tasks = 0;
};

/// List scheduling: a thread that is free takes the task that began first of those whose results
/// are there, after the parts of what others share. Whoever comes first to a work makes it; the
/// others wait, or help. threads: > 0.
Playback play(const PlayedTrace& trace, std::size_t threads);

}  // namespace baton
