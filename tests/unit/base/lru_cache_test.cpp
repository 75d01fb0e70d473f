#include "common/base/lru_cache.h"

#include <gtest/gtest.h>

#include <string>

namespace baton {
namespace {

using Cache = LruCache<int, std::string>;
std::size_t length(const std::string& text) { return text.size(); }
Cache::ValuePtr text(const std::string& text) { return std::make_shared<const std::string>(text); }

TEST(LruCache, DropsTheLeastRecentlyUsed) {
  Cache cache(6, length);
  for (const int key : {1, 2, 3}) cache.insert(key, text("ab"));
  ASSERT_NE(cache.find(1), nullptr);
  cache.insert(4, text("cd"));
  EXPECT_EQ(cache.find(2), nullptr);
  EXPECT_NE(cache.find(1), nullptr);
}

TEST(LruCache, KeepsTheNewestHoweverLargeItIs) {
  Cache cache(6, length);
  cache.insert(1, text("ab"));
  cache.insert(2, text("larger than all"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_NE(cache.find(2), nullptr);
  cache.insert(3, text("ab"));
  EXPECT_EQ(cache.find(2), nullptr);
}

TEST(LruCache, KeepsNoMoreEntriesThanAsked) {
  Cache cache(100, length, 2);
  for (const int key : {1, 2, 3}) cache.insert(key, text("ab"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_NE(cache.find(2), nullptr);
}

TEST(LruCache, KeepsTheFirstOfAKey) {
  Cache cache(6, length);
  cache.insert(1, text("ab"));
  EXPECT_EQ(*cache.insert(1, text("cd")), "ab");
}

TEST(LruCache, LeavesWhatIsHeldAlive) {
  Cache cache(2, length);
  const Cache::ValuePtr held = cache.insert(1, text("ab"));
  cache.insert(2, text("cd"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_EQ(*held, "ab");
}

// Two caches of one share: whoever keeps something new makes room among its own.
TEST(LruCache, CachesShareMemory) {
  const auto share = std::make_shared<MemoryShare>(6);
  Cache first(share, length);
  {
    Cache second(share, length);
    for (const int key : {1, 2}) first.insert(key, text("ab"));
    for (const int key : {1, 2}) second.insert(key, text("cd"));
    EXPECT_EQ(second.find(1), nullptr);
    EXPECT_NE(second.find(2), nullptr);
    EXPECT_NE(first.find(1), nullptr);
    EXPECT_EQ(share->used(), 6u);
  }
  EXPECT_EQ(share->used(), 4u) << "what a cache has taken goes back with it";
}

}  // namespace
}  // namespace baton
