#pragma once

#include <cstdint>
#include <memory>
#include <mutex>

namespace baton {

/// A share of the memory that a process may use, of which several keepers take parts. It counts; it
/// allocates nothing. Any number of threads.
class MemoryShare {
 public:
  explicit MemoryShare(std::uint64_t bytes) : bytes_(bytes) {}

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t used() const {
    const std::lock_guard lock(mutex_);
    return used_;
  }
  bool is_over() const { return used() > bytes_; }

  /// Takes a part if there is room for it. Returns whether there was.
  bool take(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    if (used_ > bytes_ || bytes > bytes_ - used_) return false;
    used_ += bytes;
    return true;
  }
  /// Takes a part, room or not.
  void overdraw(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    used_ += bytes;
  }
  void give_back(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    used_ -= bytes;
  }

 private:
  const std::uint64_t bytes_;
  mutable std::mutex mutex_;
  std::uint64_t used_ = 0;
};

using MemorySharePtr = std::shared_ptr<MemoryShare>;

}  // namespace baton
