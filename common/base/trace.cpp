#include "common/base/trace.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <system_error>
#include <utility>

#include "common/base/cpu_clock.h"
#include "common/base/file_descriptor.h"
#include "common/base/legible.h"

namespace baton {
namespace {

/// Spans are kept in memory up to so many bytes, or to the end of a task.
constexpr std::size_t kMostWaiting = 64u << 10;

/// Numbers of threads, in the order in which they are first seen.
int thread_number() {
  static std::atomic<int> next{1};
  thread_local const int number = next++;
  return number;
}

std::int64_t steady_ns(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}
std::int64_t steady_ns() { return steady_ns(std::chrono::steady_clock::now()); }

/// The file of this process's spans.
class TraceFile {
 public:
  bool is_open() const { return is_open_; }

  Status open(const std::filesystem::path& file, std::string process) {
    const std::lock_guard lock(mutex_);
    path_ = file;
    process_ = std::move(process);
    // Spans are given the time of day by one clock, whatever happens to it meanwhile.
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    day_ns_ = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - steady_ns();
    return begin();
  }
  void close() {
    const std::lock_guard lock(mutex_);
    flush();
    end();
  }
  void name_thread(std::string name) {
    const std::lock_guard lock(mutex_);
    const std::string& kept = threads_[thread_number()] = std::move(name);
    if (is_open_) append(thread_line(thread_number(), kept));
  }
  /// Adds a span of the calling thread. cpu_us: negative: not known.
  void add(SpanKind kind, std::string_view name, std::int64_t start_ns, std::int64_t end_ns,
           double cpu_us, std::string_view arguments) {
    const std::string cpu = cpu_us < 0 ? "" : fmt::format(R"(,"tdur":{:.0f})", cpu_us);
    const std::string args = arguments.empty() ? "" : fmt::format(R"(,"args":{{{}}})", arguments);
    const std::lock_guard lock(mutex_);
    if (!is_open_) return;
    append(fmt::format(
        R"({{"name":{},"cat":"{}","ph":"X","ts":{:.1f},"dur":{:.1f}{},"pid":{},"tid":{}{}}})",
        json_string(name), span_kind_name(kind), 1e-3 * static_cast<double>(start_ns + day_ns_),
        1e-3 * static_cast<double>(end_ns - start_ns), cpu, ::getpid(), thread_number(), args));
    if (kind == SpanKind::task || waiting_.size() > kMostWaiting) flush();
  }

 private:
  std::string thread_line(int number, const std::string& name) const {
    return fmt::format(
        R"({{"name":"thread_name","ph":"M","pid":{},"tid":{},"args":{{"name":{}}}}})", ::getpid(),
        number, json_string(name));
  }
  void append(const std::string& line) {
    waiting_ += line;
    waiting_ += ",\n";
  }
  Status begin() {
    file_ = FileDescriptor(::open(
        path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600));
    struct stat status {};
    if (!file_ || ::fstat(file_.number(), &status) != 0)
      return Error{ErrorKind::io, fmt::format("{}: {}", path_.string(), std::strerror(errno))};
    bytes_ = static_cast<std::size_t>(status.st_size);
    is_open_ = true;
    // After whatever a process that was killed has left there.
    waiting_ += bytes_ == 0 ? "[\n" : "\n";
    append(fmt::format(R"({{"name":"process_name","ph":"M","pid":{},"args":{{"name":{}}}}})",
                       ::getpid(), json_string(process_)));
    for (const auto& [number, name] : threads_) append(thread_line(number, name));
    return {};
  }
  void end() {
    is_open_ = false;
    file_ = FileDescriptor(-1);
    waiting_.clear();
  }
  void flush() {
    if (!is_open_) return;
    for (std::size_t done = 0; done < waiting_.size();) {
      const ssize_t written =
          ::write(file_.number(), waiting_.data() + done, waiting_.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return give_up(std::strerror(errno));
      done += static_cast<std::size_t>(written);
    }
    bytes_ += waiting_.size();
    waiting_.clear();
    if (bytes_ < kMaxTraceFileBytes) return;
    const std::filesystem::path aside =
        path_.parent_path() / (path_.stem().string() + ".1" + path_.extension().string());
    std::error_code error;
    std::filesystem::rename(path_, aside, error);
    if (error) return give_up(error.message());
    if (const Status begun = begin(); !begun) give_up(begun.error().message);
  }
  void give_up(const std::string& reason) {
    spdlog::warn("{}: the trace ends here: {}", path_.string(), reason);
    end();
  }

  std::mutex mutex_;
  std::atomic<bool> is_open_ = false;
  std::filesystem::path path_;
  std::string process_;
  FileDescriptor file_{-1};
  std::size_t bytes_ = 0;
  std::string waiting_;
  /// What the steady clock lacks of the time since 1970.
  std::int64_t day_ns_ = 0;
  std::map<int, std::string> threads_;
};

TraceFile& trace() {
  static TraceFile file;
  return file;
}

}  // namespace

std::string_view span_kind_name(SpanKind kind) {
  constexpr std::array<std::string_view, static_cast<std::size_t>(last_of(SpanKind())) + 1> kNames{
      "task", "frame", "make", "help", "wait", "share", "read", "write", "phase", "publish"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string json_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : legible_line(text)) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

Span::Span(SpanKind kind, std::string name) : kind_(kind), is_recorded_(trace().is_open()) {
  if (!is_recorded_) return;
  name_ = std::move(name);
  start_ns_ = steady_ns();
  cpu_start_ = thread_cpu_seconds();
}

Span::~Span() {
  if (!is_recorded_) return;
  if (!arguments_.empty()) arguments_.pop_back();
  trace().add(kind_, name_, start_ns_, steady_ns(), 1e6 * (thread_cpu_seconds() - cpu_start_),
              arguments_);
}

void Span::add(std::string_view key, std::int64_t value) { add_json(key, std::to_string(value)); }
void Span::add(std::string_view key, std::string_view text) {
  if (is_recorded_) add_json(key, json_string(text));
}
void Span::add_json(std::string_view key, std::string_view json) {
  if (is_recorded_) arguments_ += fmt::format(R"("{}":{},)", key, json);
}
void Span::add_members(std::string_view members) {
  if (is_recorded_) arguments_ += fmt::format("{},", members);
}
void Span::rename(std::string name) { name_ = std::move(name); }

void record_span(SpanKind kind, std::string_view name, std::chrono::steady_clock::time_point from,
                 std::chrono::steady_clock::time_point to, std::string_view arguments) {
  if (trace().is_open()) trace().add(kind, name, steady_ns(from), steady_ns(to), -1, arguments);
}

std::unique_lock<std::mutex> lock_traced(std::mutex& mutex, std::string_view what) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (lock.owns_lock()) return lock;
  const Span wait(SpanKind::wait, std::string(what));
  lock.lock();
  return lock;
}

void name_traced_thread(std::string name) { trace().name_thread(std::move(name)); }

Status trace_to_file(const std::filesystem::path& file, std::string process) {
  return trace().open(file, std::move(process));
}

void end_trace() { trace().close(); }

}  // namespace baton
