#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/base/trace.h"

namespace baton {

/// What a trace says of a task (worker/run/task_trace.h).
struct TracedTask {
  /// The digest of its version, in hexadecimal digits.
  std::string job;
  std::string id;    ///< of its job; empty: it was not loaded
  std::string kind;  ///< task_name()
  std::int32_t position = 0, tile = 0;
  std::int32_t first = 0, last = -1;  ///< the steps that a render task renders
  /// Whose films an assembly joins; -1: it is none.
  std::int32_t step = -1;
  /// Each [BlobKind, position, tile].
  std::vector<std::array<std::int32_t, 3>> inputs = {};
  bool is_lost = false;  ///< it has made nothing
};

/// A span of a trace (common/base/trace.h).
struct TracedSpan {
  SpanKind kind = SpanKind::phase;
  std::string name;
  std::int32_t process = 0, thread = 0;  ///< the process as Trace::processes has it
  double start_s = 0;                    ///< since 1970, UTC
  double seconds = 0;
  /// Of its thread meanwhile; negative: not known.
  double cpu_seconds = -1;
  std::int32_t step = -1;  ///< of a frame
  TracedTask task = {};    ///< of a task, and of one that is published
  std::string line = {};   ///< as it stood in the file

  double end_s() const { return start_s + seconds; }
};

struct TracedThread {
  std::int32_t process = 0, thread = 0;
  std::string name;
};

/// What some processes did.
struct Trace {
  std::vector<std::string> processes;  ///< by their number: their names
  std::vector<TracedThread> threads;   ///< those that have names
  std::vector<TracedSpan> spans;       ///< in the order of their starts

  double begin_s() const { return spans.empty() ? 0 : spans.front().start_s; }
  double end_s() const;
};

/// Reads a trace file of this program: of a process, or one that write_trace() wrote. Lines that a
/// process that was killed has left unfinished, and what other programs have added, are skipped.
/// Errors: io; bad_input where there is no span.
Result<Trace> read_trace(const std::filesystem::path& file);

/// The traces of all workers' files in the folder of their logs (common/store/worker_logs.h), files
/// that were put aside included. A folder that is not there has none.
Trace read_worker_traces(const std::filesystem::path& logs);

/// Only what came to an end after a time, since 1970.
void keep_since(Trace& trace, double seconds);
/// Only threads that had a task of the job: its tasks with what lies in them. What these threads
/// did for others is "a task of another job".
void keep_job(Trace& trace, std::string_view id);

/// A span's name without what counts it: "light of frame 7, round 2" is "light of frame".
std::string without_number(const std::string& name);

/// Writes a trace as Chrome's Trace Event Format has it, an event a line, times from its start on.
/// Error: io.
Status write_trace(const std::filesystem::path& file, const Trace& trace);

}  // namespace baton
