#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// What the threads of a process did, and for what they waited: spans of time in a file, in the
/// Trace Event Format that Chrome has introduced (Perfetto and speedscope read it, too). Off until
/// trace_to_file(); then a span takes some microseconds.

/// What a span is. Written by name (span_kind_name); readers skip kinds that they do not know.
enum class SpanKind : std::uint8_t {
  task,   ///< a task on its thread, from end to end
  frame,  ///< a tile in a frame, in a task
  /// What others may wait for, such as the light of a frame; its name says what.
  make,
  help,  ///< a part of what another thread makes
  wait,  ///< for what another thread makes
  /// What a thread does together with those who have nothing to do; each does parts of it (help).
  share,
  read,
  write,
  phase,    ///< of a program's life
  publish,  ///< a task from its end to its report
};
constexpr SpanKind last_of(SpanKind) { return SpanKind::publish; }
std::string_view span_kind_name(SpanKind kind);

/// What a thread does while the object lives. Spans of a thread lie in each other.
class Span {
 public:
  /// name: for people, and what tells spans of a kind apart.
  Span(SpanKind kind, std::string name);
  ~Span();
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;

  /// Adds to the span's arguments, the members of an object. json: a value in JSON.
  void add(std::string_view key, std::int64_t value);
  void add(std::string_view key, std::string_view text);
  void add_json(std::string_view key, std::string_view json);
  /// Adds members of a JSON object.
  void add_members(std::string_view members);
  void rename(std::string name);

 private:
  SpanKind kind_;
  bool is_recorded_;
  std::string name_;
  /// Members of an object, with a comma after each.
  std::string arguments_;
  std::int64_t start_ns_ = 0;
  double cpu_start_ = 0;
};

/// A span that has passed already, of the calling thread. arguments: members of a JSON object.
void record_span(SpanKind kind, std::string_view name, std::chrono::steady_clock::time_point from,
                 std::chrono::steady_clock::time_point to, std::string_view arguments);

/// Locks; where that takes time, the trace says that the thread has waited for `what`.
std::unique_lock<std::mutex> lock_traced(std::mutex& mutex, std::string_view what);

/// What the calling thread is called in traces.
void name_traced_thread(std::string name);

/// From now on spans go to the end of a file, a line each, as it stands at the end of each task.
/// Once it has kMaxTraceFileBytes it is put aside as "NAME.1.EXTENSION", in place of the one
/// before. process: what the process is called. Its folder must be there. Error (io): the disk;
/// one that comes later ends the trace.
Status trace_to_file(const std::filesystem::path& file, std::string process);
inline constexpr std::size_t kMaxTraceFileBytes = 32u << 20;
/// Writes what is left, and ends the trace.
void end_trace();

/// A string in JSON, quotes included.
std::string json_string(std::string_view text);

}  // namespace baton
