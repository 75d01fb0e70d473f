#pragma once

#include <cstddef>
#include <list>
#include <mutex>
#include <unordered_map>

#include "common/base/digest.h"
#include "common/base/limits.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// Decoded states that this process made or read last, by the digest of their file: where things
/// move, a state is the input of several tasks. Holds at most max_bytes of them, counted
/// as they are; the least recently used ones go first. Any number of threads.
class StateCache {
 public:
  explicit StateCache(std::size_t max_bytes = limits::kMaxStateCacheBytes)
      : max_bytes_(max_bytes) {}

  /// Null: not here.
  StatePtr find(const Digest& digest);
  void insert(const Digest& digest, StatePtr state);
  /// What it holds now.
  std::size_t size_bytes() const;

 private:
  using Entry = std::pair<Digest, StatePtr>;
  struct Hash {
    std::size_t operator()(const Digest& digest) const { return digest.low; }
  };

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  ///< most recently used in front
  std::unordered_map<Digest, std::list<Entry>::iterator, Hash> index_;
  std::size_t size_bytes_ = 0;
};

}  // namespace baton
