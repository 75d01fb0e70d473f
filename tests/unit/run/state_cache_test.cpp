#include "worker/run/state_cache.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

StatePtr state_of(std::int32_t side, bool with_memory) {
  SampleState state;
  state.resize({0, 0, side, side}, with_memory ? 0 : 16);
  if (with_memory) state.add_memory();
  return std::make_shared<const SampleState>(std::move(state));
}

// A pixel of `pool` takes 529 bytes, most of them its memory of rays.
TEST(StateCache, CountsWhatStatesTake) {
  StateCache cache(1 << 20);
  cache.insert(digest_of("pool"), state_of(10, true));
  EXPECT_EQ(cache.size_bytes(), 100u * 529);
  cache.insert(digest_of("sequential"), state_of(10, false));
  EXPECT_EQ(cache.size_bytes(), 100u * (529 + 9 + 16 * 9));
}

TEST(StateCache, HoldsNoMoreThanItMayAndDropsTheLeastRecentlyUsed) {
  StateCache cache(3 * 100 * 529);
  for (const char* name : {"a", "b", "c"}) cache.insert(digest_of(name), state_of(10, true));
  ASSERT_NE(cache.find(digest_of("a")), nullptr);
  cache.insert(digest_of("d"), state_of(10, true));
  EXPECT_EQ(cache.find(digest_of("b")), nullptr);
  EXPECT_NE(cache.find(digest_of("a")), nullptr);
  EXPECT_EQ(cache.size_bytes(), 3u * 100 * 529);

  // One that is too large alone is not kept.
  cache.insert(digest_of("large"), state_of(100, true));
  EXPECT_EQ(cache.size_bytes(), 0u);
}

}  // namespace
}  // namespace baton
