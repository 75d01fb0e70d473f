#include "worker/run/state_cache.h"

#include <utility>

#include "common/base/limits.h"

namespace baton {
namespace {

std::size_t size_bytes(const SampleState& state) {
  constexpr std::size_t kPixelBytes = 2 * sizeof(float) + sizeof(PixelSource);
  constexpr std::size_t kParticleBytes =
      sizeof(OctDirection) + sizeof(float) + sizeof(std::uint8_t);
  return state.num_pixels() * kPixelBytes + state.direction.size() * kParticleBytes;
}

}  // namespace

StatePtr StateCache::find(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto found = index_.find(digest);
  if (found == index_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->second;
}

void StateCache::insert(const Digest& digest, StatePtr state) {
  const std::lock_guard lock(mutex_);
  if (index_.contains(digest)) return;
  size_bytes_ += size_bytes(*state);
  entries_.emplace_front(digest, std::move(state));
  index_[digest] = entries_.begin();

  // Make room; whoever still uses a state keeps it alive.
  while (size_bytes_ > limits::kMaxStateCacheBytes) {
    size_bytes_ -= size_bytes(*entries_.back().second);
    index_.erase(entries_.back().first);
    entries_.pop_back();
  }
}

}  // namespace baton
