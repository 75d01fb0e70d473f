#include "worker/run/state_cache.h"

namespace baton {

bool HeldStates::hold(const BlobRef& ref, StatePtr state) {
  const std::lock_guard lock(mutex_);
  if (states_.contains(ref.digest)) return true;  // made again: the same
  const std::size_t size = state->size_bytes();
  if (size_bytes_ + size > max_bytes_) return false;
  size_bytes_ += size;
  states_.emplace(ref.digest, std::pair(ref, std::move(state)));
  return true;
}

HeldStates::StatePtr HeldStates::find(const Digest& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = states_.find(name);
  return found == states_.end() ? nullptr : found->second.second;
}

HeldStates::List HeldStates::states(const std::vector<Digest>& names) const {
  const std::lock_guard lock(mutex_);
  List result;
  for (const Digest& name : names) {
    if (const auto found = states_.find(name); found != states_.end())
      result.push_back(found->second);
  }
  return result;
}

HeldStates::List HeldStates::all() const {
  const std::lock_guard lock(mutex_);
  List result;
  for (const auto& [name, entry] : states_) result.push_back(entry);
  return result;
}

void HeldStates::release_before(std::int32_t frame) {
  const std::lock_guard lock(mutex_);
  std::erase_if(states_, [&](const auto& named) {
    const auto& [ref, state] = named.second;
    if (ref.frame >= frame) return false;
    size_bytes_ -= state->size_bytes();
    return true;
  });
}

std::size_t HeldStates::size_bytes() const {
  const std::lock_guard lock(mutex_);
  return size_bytes_;
}

}  // namespace baton
