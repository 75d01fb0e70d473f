#include "jobs/cli/signals.h"

#include <ctime>

namespace baton {

SignalWait::SignalWait() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &signals_, &before_);
}

SignalWait::~SignalWait() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

bool SignalWait::stop_requested_within(std::chrono::milliseconds time) const {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(time);
  const std::chrono::nanoseconds rest = time - seconds;
  const timespec timeout{.tv_sec = seconds.count(), .tv_nsec = rest.count()};
  return ::sigtimedwait(&signals_, nullptr, &timeout) > 0;
}

}  // namespace baton
