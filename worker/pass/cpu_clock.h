#pragma once

#include <ctime>

namespace baton {

/// CPU seconds of the calling thread.
inline double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Adds the CPU seconds of its scope to a counter.
class StageTimer {
 public:
  explicit StageTimer(double& seconds) : seconds_(seconds), start_(thread_cpu_seconds()) {}
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  ~StageTimer() { seconds_ += thread_cpu_seconds() - start_; }

 private:
  double& seconds_;
  double start_;
};

}  // namespace baton
