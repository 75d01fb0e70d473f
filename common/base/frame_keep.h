#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/memory_share.h"

namespace baton {

/// Values of frames, by key, that stay until their frame is released, as far as a share of memory
/// has room: what does not fit is not kept. Nothing is pushed out by what comes later: frames ask
/// for the values of the frame before in the order in which they came, so what came first is needed
/// first. Any number of threads. Key: ordered.
template <class Key, class Value>
class FrameKeep {
 public:
  using ValuePtr = std::shared_ptr<const Value>;

  explicit FrameKeep(MemorySharePtr share) : share_(std::move(share)) {}
  FrameKeep(const FrameKeep&) = delete;
  FrameKeep& operator=(const FrameKeep&) = delete;
  ~FrameKeep() { clear(); }

  /// Keeps the value of a frame (0-based), which has a size_bytes(); where there is one of this
  /// key, that one stays. False: there is no room.
  bool keep(const Key& key, std::int32_t frame, ValuePtr value) {
    const std::lock_guard lock(mutex_);
    if (entries_.contains(key)) return true;
    const std::size_t size = value->size_bytes();
    if (!share_->take(size)) return false;
    size_ += size;
    entries_.emplace(key, Entry{frame, size, std::move(value)});
    return true;
  }
  /// Null: not here.
  ValuePtr find(const Key& key) const {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : found->second.value;
  }
  /// Forgets the values of frames before this one.
  void release_before(std::int32_t frame) {
    release_if([frame](const Entry& entry) { return entry.frame < frame; });
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
  /// What all values take.
  std::size_t size_bytes() const {
    const std::lock_guard lock(mutex_);
    return size_;
  }

 private:
  struct Entry {
    std::int32_t frame = 0;
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
