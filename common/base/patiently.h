#pragma once

#include <chrono>
#include <stop_token>

#include "common/base/result.h"

namespace baton {

/// Logs what is waited for, once, and lets time pass: 50 ms, then twice as long each time, a second
/// and a half in all. False at once: the error is none of the moment (ErrorKind::io), the waits are
/// used up, or `stop` is requested.
class Patience {
 public:
  explicit Patience(const std::stop_token& stop = {}) : stop_(stop) {}
  bool wait_after(const Error& error);

 private:
  static constexpr int kWaits = 5;

  const std::stop_token stop_;
  std::chrono::milliseconds pause_{50};
  int waits_ = 0;
};

/// Looks at a file or puts one: a disk may be away for a moment, and what another machine has
/// written be seen here later. What ends with such an error is done again, and what it is done for
/// is not. look() returns a Result; what it does may be done several times.
template <class Look>
auto patiently(const Look& look, Patience& patience) {
  auto result = look();
  while (!result && patience.wait_after(result.error())) result = look();
  return result;
}
template <class Look>
auto patiently(const Look& look, const std::stop_token& stop = {}) {
  Patience patience(stop);
  return patiently(look, patience);
}

}  // namespace baton
