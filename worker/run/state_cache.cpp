#include "worker/run/state_cache.h"

#include <utility>

namespace baton {

StatePtr StateCache::find(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto found = index_.find(digest);
  if (found == index_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->second;
}

std::size_t StateCache::size_bytes() const {
  const std::lock_guard lock(mutex_);
  return size_bytes_;
}

void StateCache::insert(const Digest& digest, StatePtr state) {
  const std::lock_guard lock(mutex_);
  if (index_.contains(digest)) return;
  size_bytes_ += state->size_bytes();
  entries_.emplace_front(digest, std::move(state));
  index_[digest] = entries_.begin();

  // Make room; whoever still uses a state keeps it alive.
  while (size_bytes_ > max_bytes_) {
    size_bytes_ -= entries_.back().second->size_bytes();
    index_.erase(entries_.back().first);
    entries_.pop_back();
  }
}

}  // namespace baton
