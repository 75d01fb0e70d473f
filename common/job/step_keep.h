#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/memory_share.h"
#include "common/job/time.h"

namespace baton {

/// Values of steps, by key, that stay until their step is released, as far as a share of memory has
/// room: what does not fit is not kept. Nothing is pushed out by what comes later: steps need the
/// values of the step before in the order in which they came, so what came first is needed first.
/// Any number of threads. Key: ordered.
template <class Key, class Value>
class StepKeep {
 public:
  using ValuePtr = std::shared_ptr<const Value>;

  explicit StepKeep(MemorySharePtr share) : share_(std::move(share)) {}
  StepKeep(const StepKeep&) = delete;
  StepKeep& operator=(const StepKeep&) = delete;
  ~StepKeep() { clear(); }

  /// Keeps the value of a step, which has a size_bytes(); where there is one of this
  /// key, that one stays. False: there is no room.
  bool keep(const Key& key, Step step, ValuePtr value) {
    const std::lock_guard lock(mutex_);
    if (entries_.contains(key)) return true;
    const std::size_t size = value->size_bytes();
    if (!share_->take(size)) return false;
    size_ += size;
    entries_.emplace(key, Entry{step, size, std::move(value)});
    return true;
  }
  /// Null: not here.
  ValuePtr find(const Key& key) const {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : found->second.value;
  }
  /// Forgets the values of steps before this one.
  void release_before(Step step) {
    release_if([step](const Entry& entry) { return entry.step < step; });
  }
  void clear() {
    release_if([](const Entry&) { return true; });
  }
  /// All, in the order of their keys.
  std::vector<std::pair<Key, ValuePtr>> all() const {
    const std::lock_guard lock(mutex_);
    std::vector<std::pair<Key, ValuePtr>> values;
    for (const auto& [key, entry] : entries_) values.emplace_back(key, entry.value);
    return values;
  }
  bool empty() const {
    const std::lock_guard lock(mutex_);
    return entries_.empty();
  }
  /// What all values take.
  std::size_t size_bytes() const {
    const std::lock_guard lock(mutex_);
    return size_;
  }

 private:
  struct Entry {
    Step step{};
    std::size_t size = 0;
    ValuePtr value;
  };

  template <class Predicate>
  void release_if(Predicate predicate) {
    std::vector<ValuePtr> released;  // destroyed without the lock
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      if (!predicate(entry->second)) {
        ++entry;
        continue;
      }
      share_->give_back(entry->second.size);
      size_ -= entry->second.size;
      released.push_back(std::move(entry->second.value));
      entry = entries_.erase(entry);
    }
  }

  const MemorySharePtr share_;
  mutable std::mutex mutex_;
  std::map<Key, Entry> entries_;
  std::size_t size_ = 0;
};

}  // namespace baton
