#include "jobs/trace/trace_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "common/base/files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::optional<SpanKind> kind_of(std::string_view name) {
  for (int kind = 0; kind <= static_cast<int>(last_of(SpanKind())); ++kind) {
    if (span_kind_name(static_cast<SpanKind>(kind)) == name) return static_cast<SpanKind>(kind);
  }
  return std::nullopt;
}

template <class T>
void take(const json& object, const char* key, T& value) {
  const auto found = object.find(key);
  if (found == object.end()) return;
  if constexpr (std::is_arithmetic_v<T>) {
    if (found->is_number()) value = found->get<T>();
  } else {
    if (found->is_string()) value = found->get<T>();
  }
}

TracedTask task_of(const json& arguments) {
  TracedTask task;
  take(arguments, "job", task.job);
  take(arguments, "id", task.id);
  take(arguments, "kind", task.kind);
  take(arguments, "position", task.position);
  take(arguments, "tile", task.tile);
  take(arguments, "first", task.first);
  take(arguments, "last", task.last);
  take(arguments, "step", task.step);
  task.is_lost = arguments.contains("lost");
  if (const auto inputs = arguments.find("inputs"); inputs != arguments.end()) {
    for (const json& input : *inputs) {
      if (!input.is_array() || input.size() != 3) continue;
      std::array<std::int32_t, 3> taken{};
      for (std::size_t i = 0; i < 3; ++i) {
        if (input[i].is_number_integer()) taken[i] = input[i].get<std::int32_t>();
      }
      task.inputs.push_back(taken);
    }
  }
  return task;
}

/// Adds files to a trace.
class TraceReader {
 public:
  /// Error: io.
  Status add(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return Error{ErrorKind::io, file.string() + ": cannot be read"};
    // A file that was put aside is of the same process.
    file_ = file.filename().string();
    file_.resize(std::min(file_.find('.'), file_.size()));
    for (std::string line; std::getline(stream, line);) {
      if (line.ends_with(',')) line.pop_back();
      json event = json::parse(line, nullptr, /*allow_exceptions=*/false);
      if (event.is_object()) add_event(event, std::move(line));
    }
    return {};
  }
  Trace finish() {
    std::ranges::stable_sort(trace_.spans, [](const TracedSpan& a, const TracedSpan& b) {
      return std::pair(a.start_s, -a.seconds) < std::pair(b.start_s, -b.seconds);
    });
    return std::move(trace_);
  }

 private:
  std::int32_t process(std::int64_t pid) {
    const auto [found, is_new] = processes_.emplace(
        std::pair(file_, pid), static_cast<std::int32_t>(trace_.processes.size()));
    if (is_new) trace_.processes.emplace_back(std::to_string(pid));
    return found->second;
  }
  void add_event(const json& event, std::string line) {
    std::string phase, name, category;
    std::int64_t pid = 0;
    TracedSpan span;
    take(event, "ph", phase);
    take(event, "name", name);
    take(event, "cat", category);
    take(event, "pid", pid);
    take(event, "tid", span.thread);
    const json arguments = event.value("args", json::object());
    if (phase == "M") {
      std::string called;
      if (arguments.is_object()) take(arguments, "name", called);
      span.process = process(pid);
      if (name == "process_name") trace_.processes[static_cast<std::size_t>(span.process)] = called;
      if (name == "thread_name") trace_.threads.push_back({span.process, span.thread, called});
      return;
    }
    const std::optional<SpanKind> kind = kind_of(category);
    if (phase != "X" || !kind || !arguments.is_object()) return;
    span.kind = *kind;
    span.name = std::move(name);
    span.process = process(pid);
    double start_us = 0, us = 0, cpu_us = -1;
    take(event, "ts", start_us);
    take(event, "dur", us);
    take(event, "tdur", cpu_us);
    span.start_s = 1e-6 * start_us;
    span.seconds = 1e-6 * us;
    span.cpu_seconds = 1e-6 * cpu_us;
    take(arguments, "step", span.step);
    if (*kind == SpanKind::task || *kind == SpanKind::publish) span.task = task_of(arguments);
    span.line = std::move(line);
    trace_.spans.push_back(std::move(span));
  }

  Trace trace_;
  std::string file_;
  /// By file and identifier.
  std::map<std::pair<std::string, std::int64_t>, std::int32_t> processes_;
};

/// The event as it is written, with other times and another process.
std::string event_line(const TracedSpan& span, double begin_s) {
  json event = json::parse(span.line, nullptr, /*allow_exceptions=*/false);
  event["name"] = span.name;
  event["ts"] = std::round(1e7 * (span.start_s - begin_s)) / 10;
  event["pid"] = span.process + 1;
  if (span.kind == SpanKind::task && span.task.kind.empty()) event.erase("args");
  return event.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

double Trace::end_s() const {
  double end = 0;
  for (const TracedSpan& span : spans) end = std::max(end, span.end_s());
  return end;
}

Result<Trace> read_trace(const fs::path& file) {
  TraceReader reader;
  BATON_TRY(reader.add(file));
  Trace trace = reader.finish();
  if (!trace.spans.empty()) return trace;
  return Error{ErrorKind::bad_input,
               file.string() +
                   ": no span is in it, expected a trace of `baton render --trace` or "
                   "`baton job trace`"};
}

Trace read_worker_traces(const fs::path& logs) {
  TraceReader reader;
  std::error_code error;
  for (fs::directory_iterator next(logs, error), end; !error && next != end;
       next.increment(error)) {
    if (next->path().extension() != ".trace") continue;
    // One that is put aside at this moment is read under its other name, or is gone.
    static_cast<void>(reader.add(next->path()));
  }
  return reader.finish();
}

void keep_since(Trace& trace, double seconds) {
  std::erase_if(trace.spans, [&](const TracedSpan& span) { return span.end_s() < seconds; });
}

void keep_job(Trace& trace, std::string_view id) {
  using Thread = std::pair<std::int32_t, std::int32_t>;
  std::set<Thread> threads;
  std::set<std::string> versions;
  double begin_s = std::numeric_limits<double>::max(), end_s = 0;
  for (const TracedSpan& span : trace.spans) {
    if (span.kind != SpanKind::task || span.task.id != id) continue;
    threads.emplace(span.process, span.thread);
    versions.insert(span.task.job);
    begin_s = std::min(begin_s, span.start_s);
    end_s = std::max(end_s, span.end_s());
  }
  // Spans of a thread come in the order of their starts, so the last task began before.
  std::map<Thread, double> own_until;
  std::map<std::pair<std::int32_t, std::string>, double> shared_until;
  std::vector<TracedSpan> kept;
  for (TracedSpan& span : trace.spans) {
    const Thread thread(span.process, span.thread);
    if (span.end_s() <= begin_s || span.start_s >= end_s) continue;
    if (span.kind == SpanKind::publish && versions.contains(span.task.job)) {
      kept.push_back(std::move(span));
    } else if (span.kind == SpanKind::task && threads.contains(thread)) {
      const bool is_own = span.task.id == id;
      own_until[thread] = is_own ? span.end_s() : 0;
      if (!is_own) {
        span.name = "a task of another job";
        span.task = {};
      }
      kept.push_back(std::move(span));
    } else if (own_until.contains(thread) && span.end_s() <= own_until[thread]) {
      if (span.kind == SpanKind::share) shared_until[{span.process, span.name}] = span.end_s();
      kept.push_back(std::move(span));
    } else if (span.kind == SpanKind::help && threads.contains(thread)) {
      const auto shared = shared_until.find({span.process, span.name});
      if (shared != shared_until.end() && span.start_s < shared->second)
        kept.push_back(std::move(span));
    }
  }
  trace.spans = std::move(kept);
}

std::string without_number(const std::string& name) {
  std::string kind = name.substr(0, name.find_first_of("0123456789"));
  while (kind.ends_with(' ')) kind.pop_back();
  return kind.empty() ? name : kind;
}

Status write_trace(const fs::path& file, const Trace& trace) {
  std::string text = "[\n";
  const auto add = [&](const std::string& line) { text += line + ",\n"; };
  const auto name = [&](const char* what, std::int32_t process, std::int32_t thread,
                        const std::string& called) {
    add(fmt::format(R"({{"name":"{}","ph":"M","pid":{},"tid":{},"args":{{"name":{}}}}})", what,
                    process + 1, thread, json_string(called)));
  };
  std::set<std::int32_t> processes;
  for (const TracedSpan& span : trace.spans) processes.insert(span.process);
  for (const std::int32_t process : processes)
    name("process_name", process, 0, trace.processes[static_cast<std::size_t>(process)]);
  for (const TracedThread& thread : trace.threads) {
    if (processes.contains(thread.process))
      name("thread_name", thread.process, thread.thread, thread.name);
  }
  for (const TracedSpan& span : trace.spans) add(event_line(span, trace.begin_s()));
  text.resize(text.size() - 2);  // no comma after the last
  text += "\n]\n";
  return write_file_atomic(file, as_bytes_view(text));
}

}  // namespace baton
