#include "common/base/patiently.h"

#include <spdlog/spdlog.h>

#include <thread>

namespace baton {

bool Patience::wait_after(const Error& error) {
  if (error.kind != ErrorKind::io || waits_ == kWaits || stop_.stop_requested()) return false;
  if (waits_++ == 0) spdlog::warn("waits for {}", error.message);
  std::this_thread::sleep_for(pause_);
  pause_ *= 2;
  return true;
}

}  // namespace baton
