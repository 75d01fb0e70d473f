#pragma once

#include <cstddef>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace baton {

/// Values by key, as many as fit into a budget: the least recently used go first, and the one used
/// last always stays. Whoever holds a value keeps it alive, so a value should not hold one of
/// another cache. Any number of threads. Key: ordered.
template <class Key, class Value>
class LruCache {
 public:
  using ValuePtr = std::shared_ptr<const Value>;
  /// What a value takes of the budget.
  using SizeOf = std::size_t (*)(const Value&);

  /// most: entries.
  LruCache(std::size_t budget, SizeOf size_of,
           std::size_t most = std::numeric_limits<std::size_t>::max())
      : budget_(budget), most_(most), size_of_(size_of) {}

  /// Null: not here.
  ValuePtr find(const Key& key) {
    const std::lock_guard lock(mutex_);
    return use(key);
  }
  /// The same, but does not count as use.
  ValuePtr peek(const Key& key) const {
    const std::lock_guard lock(mutex_);
    const auto found = index_.find(key);
    return found == index_.end() ? nullptr : found->second->second;
  }
  /// Keeps a value, unless there is one, and returns what is there.
  ValuePtr insert(const Key& key, ValuePtr value) {
    const std::lock_guard lock(mutex_);
    if (ValuePtr there = use(key)) return there;
    entries_.emplace_front(key, value);
    index_.emplace(key, entries_.begin());
    size_ += size_of_(*value);
    while ((size_ > budget_ || entries_.size() > most_) && entries_.size() > 1) {
      size_ -= size_of_(*entries_.back().second);
      index_.erase(entries_.back().first);
      entries_.pop_back();
    }
    return value;
  }
  /// Forgets the values for which predicate(value) holds.
  template <class Predicate>
  void erase_if(Predicate predicate) {
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      if (!predicate(*entry->second)) {
        ++entry;
        continue;
      }
      size_ -= size_of_(*entry->second);
      index_.erase(entry->first);
      entry = entries_.erase(entry);
    }
  }
  /// What all values take now.
  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return size_;
  }

 private:
  ValuePtr use(const Key& key) {
    const auto found = index_.find(key);
    if (found == index_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().second;
  }

  const std::size_t budget_, most_;
  const SizeOf size_of_;
  mutable std::mutex mutex_;
  using Entries = std::list<std::pair<Key, ValuePtr>>;
  Entries entries_;  ///< most recently used in front
  std::map<Key, typename Entries::iterator> index_;
  std::size_t size_ = 0;
};

}  // namespace baton
