#pragma once

#include <cstddef>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "common/base/memory_share.h"

namespace baton {

/// Values by key, as many as fit into a share of memory, which other caches may use, too: the least
/// recently used go first, and the one used last always stays. Whoever has a value keeps it alive,
/// so a value should not contain one of another cache. Any number of threads. Key: ordered.
template <class Key, class Value>
class LruCache {
 public:
  using ValuePtr = std::shared_ptr<const Value>;
  /// What a value takes of the share.
  using SizeOf = std::size_t (*)(const Value&);

  /// most, least: entries; so many of those used last stay however large they are.
  LruCache(MemorySharePtr share, SizeOf size_of,
           std::size_t most = std::numeric_limits<std::size_t>::max(), std::size_t least = 1)
      : share_(std::move(share)), most_(most), least_(least), size_of_(size_of) {}
  /// With a share of its own.
  LruCache(std::size_t budget, SizeOf size_of,
           std::size_t most = std::numeric_limits<std::size_t>::max())
      : LruCache(std::make_shared<MemoryShare>(budget), size_of, most) {}
  LruCache(const LruCache&) = delete;
  LruCache& operator=(const LruCache&) = delete;
  ~LruCache() {
    while (!entries_.empty()) drop_last();
  }

  /// Null: not here.
  ValuePtr find(const Key& key) {
    const std::lock_guard lock(mutex_);
    return use(key);
  }
  /// Keeps a value, unless there is one, and returns what is there.
  ValuePtr insert(const Key& key, ValuePtr value) {
    const std::lock_guard lock(mutex_);
    if (ValuePtr there = use(key)) return there;
    const std::size_t size = size_of_(*value);
    entries_.push_front({key, value, size});
    index_.emplace(key, entries_.begin());
    share_->overdraw(size);
    while (entries_.size() > least_ && (share_->is_over() || entries_.size() > most_)) drop_last();
    return value;
  }

 private:
  struct Entry {
    Key key;
    ValuePtr value;
    std::size_t size;
  };

  ValuePtr use(const Key& key) {
    const auto found = index_.find(key);
    if (found == index_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().value;
  }
  void drop_last() {
    share_->give_back(entries_.back().size);
    index_.erase(entries_.back().key);
    entries_.pop_back();
  }

  const MemorySharePtr share_;
  const std::size_t most_, least_;
  const SizeOf size_of_;
  std::mutex mutex_;
  std::list<Entry> entries_;  ///< most recently used in front
  std::map<Key, typename std::list<Entry>::iterator> index_;
};

}  // namespace baton
