#pragma once

#include "common/base/digest.h"
#include "common/base/limits.h"
#include "common/base/lru_cache.h"
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
};

}  // namespace baton
