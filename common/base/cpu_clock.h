#pragma once

#include <chrono>
#include <ctime>

namespace baton {

/// CPU seconds of the calling thread. A system call: about a microsecond.
inline double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Seconds that pass for everybody. Some tens of nanoseconds.
inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Adds the seconds of its scope to a counter. Clock: a function that returns seconds.
template <double (*Clock)()>
class ScopeTimer {
 public:
  explicit ScopeTimer(double& seconds) : seconds_(seconds), start_(Clock()) {}
  ScopeTimer(const ScopeTimer&) = delete;
  ScopeTimer& operator=(const ScopeTimer&) = delete;
  ~ScopeTimer() { seconds_ += Clock() - start_; }

 private:
  double& seconds_;
  double start_;
};

/// CPU seconds, for scopes of a millisecond or more.
using CpuTimer = ScopeTimer<thread_cpu_seconds>;

/// Wall seconds, for the many short stages of a piece of work, which a WorkClock turns into CPU
/// seconds when the piece is done.
using StageTimer = ScopeTimer<wall_seconds>;

/// The clocks of a piece of work on one thread, from construction on.
class WorkClock {
 public:
  double cpu_seconds() const { return thread_cpu_seconds() - cpu_start_; }
  /// CPU seconds per wall second so far, (0, 1]: less than 1 where the thread had to wait.
  double running_share() const {
    const double wall = wall_seconds() - wall_start_;
    return wall > 0 ? cpu_seconds() / wall : 1.0;
  }

 private:
  double cpu_start_ = thread_cpu_seconds();
  double wall_start_ = wall_seconds();
};

}  // namespace baton
