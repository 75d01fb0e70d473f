#pragma once

#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/team.h"

namespace baton {

/// Threads that have nothing to do, as many as somebody can use.
class LentThreads {
 public:
  ~LentThreads() { join(); }
  Lend lend() {
    return [this](std::function<void()> work) {
      const std::lock_guard lock(mutex_);
      threads_.emplace_back(std::move(work));
      ++num_lent_;
      return true;
    };
  }
  /// How many were, since the beginning.
  std::size_t join() {
    const std::lock_guard lock(mutex_);
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
    return num_lent_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::thread> threads_;
  std::size_t num_lent_ = 0;
};

}  // namespace baton
