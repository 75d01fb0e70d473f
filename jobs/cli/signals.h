#pragma once

#include <signal.h>

#include <chrono>

namespace baton {

/// Turns SIGINT and SIGTERM into values while it lives: they are blocked and wait to be asked for.
/// Construct it before any thread starts; child processes must unblock them (ChildProcess does).
class SignalWait {
 public:
  SignalWait();
  ~SignalWait();
  SignalWait(const SignalWait&) = delete;
  SignalWait& operator=(const SignalWait&) = delete;

  /// Sleeps for `time` or until a signal comes; true when one came.
  bool stop_requested_within(std::chrono::milliseconds time) const;

 private:
  sigset_t signals_{};
  sigset_t before_{};
};

}  // namespace baton
