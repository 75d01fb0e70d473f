#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <limits>

namespace baton {

/// Counts what Embree allocates, and stops it from taking more than is allowed.
struct AllocationCount {
  std::atomic<std::int64_t> bytes{0};
  std::int64_t allowed = std::numeric_limits<std::int64_t>::max();
  std::atomic<bool> was_exceeded{false};

  /// change: negative where memory is given back. The answer counts for allocations alone.
  static bool note(void* count, ssize_t change, bool /*done*/) {
    auto& self = *static_cast<AllocationCount*>(count);
    const std::int64_t now = self.bytes += change;
    if (change <= 0 || now <= self.allowed) return true;
    self.was_exceeded = true;
    return false;
  }
};

}  // namespace baton
