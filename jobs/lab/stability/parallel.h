#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace baton::stability {

/// Calls work(i) for every i in [0, count) from `threads` threads. What work(i) stores must be its
/// own.
inline void parallel_for(std::size_t count, int threads,
                         const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> pool;
  for (int t = 0; t < threads; ++t) {
    pool.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
  }
}

}  // namespace baton::stability
