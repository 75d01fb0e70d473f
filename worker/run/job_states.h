#pragma once

#include <map>
#include <mutex>
#include <vector>

#include "common/base/digest.h"
#include "common/base/limits.h"
#include "common/base/lru_cache.h"
#include "common/job/task.h"
#include "common/state/sample_state.h"

namespace baton {

/// Decoded states that this process made or read last, by the digest of their file: where things
/// move, a state is the input of several tasks. Counted in bytes. Ask with peek(): tiles come round
/// in the same order in each frame, so the state that came first is the one that nobody needs any
/// more, and the one that was not used for longest is about to be needed.
class StateCache : public LruCache<Digest, SampleState> {
 public:
  explicit StateCache(std::size_t max_bytes = limits::kMaxStateCacheBytes)
      : LruCache(max_bytes, [](const SampleState& state) { return state.size_bytes(); }) {}

  /// Forgets the states of frames (0-based) before this one: no task needs them.
  void release_before(std::int32_t frame) {
    erase_if([frame](const SampleState& state) { return state.frame_index < frame; });
  }
};

/// The states of one job that are in this process alone, by the name of BlobRef::is_held(): they
/// stay until no task needs them. Any number of threads.
class HeldStates {
 public:
  using StatePtr = std::shared_ptr<const SampleState>;
  using List = std::vector<std::pair<BlobRef, StatePtr>>;

  explicit HeldStates(std::size_t max_bytes = limits::kMaxHeldStateBytes) : max_bytes_(max_bytes) {}

  /// False: there is no room, and it is not held.
  bool hold(const BlobRef& ref, StatePtr state);
  /// Null: it is not here.
  StatePtr find(const Digest& name) const;
  /// Those of the named ones that are here; all, in the order of their names.
  List states(const std::vector<Digest>& names) const;
  List all() const;
  /// Forgets the states of frames (0-based) before this one.
  void release_before(std::int32_t frame);
  std::size_t size_bytes() const;

 private:
  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::map<Digest, List::value_type> states_;
  std::size_t size_bytes_ = 0;
};

}  // namespace baton
