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
  EXPECT_EQ(cache.size(), 6u);
}

TEST(LruCache, KeepsTheNewestHoweverLargeItIs) {
  Cache cache(6, length);
  cache.insert(1, text("ab"));
  cache.insert(2, text("larger than all"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_NE(cache.find(2), nullptr);
  cache.insert(3, text("ab"));
  EXPECT_EQ(cache.find(2), nullptr);
  EXPECT_EQ(cache.size(), 2u);
}

TEST(LruCache, KeepsNoMoreEntriesThanAsked) {
  Cache cache(100, length, 2);
  for (const int key : {1, 2, 3}) cache.insert(key, text("ab"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_NE(cache.find(2), nullptr);
  EXPECT_EQ(cache.size(), 4u);
}

TEST(LruCache, KeepsTheFirstOfAKey) {
  Cache cache(6, length);
  cache.insert(1, text("ab"));
  EXPECT_EQ(*cache.insert(1, text("cd")), "ab");
  EXPECT_EQ(cache.size(), 2u);
}

TEST(LruCache, LeavesWhatIsHeldAlive) {
  Cache cache(2, length);
  const Cache::ValuePtr held = cache.insert(1, text("ab"));
  cache.insert(2, text("cd"));
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_EQ(*held, "ab");
}

}  // namespace
}  // namespace baton
