#include "worker/pass/pixel_order.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace baton {
namespace {

std::vector<std::uint32_t> all_slots(const PixelOrder& order) {
  std::vector<std::uint32_t> slots;
  for (std::size_t i = 0; i < order.num_batches(); ++i)
    slots.insert(slots.end(), order.batch(i).begin(), order.batch(i).end());
  return slots;
}

TEST(PixelOrder, GoesRowByRowWithoutBlocks) {
  const PixelOrder order({0, 0, 10, 13}, RoundPixels::all(130), PixelOrder::Blocks::none, 64);
  EXPECT_EQ(order.num_batches(), 3u);
  const std::vector<std::uint32_t> slots = all_slots(order);
  EXPECT_EQ(slots.size(), 130u);
  EXPECT_TRUE(std::ranges::is_sorted(slots));
  EXPECT_EQ(PixelOrder({0, 0, 1, 1}, RoundPixels(), PixelOrder::Blocks::none, 64).num_batches(),
            0u);
}

// What is appended stays together, in batches as full as that allows.
TEST(PixelOrder, GrowsByWhatStaysTogether) {
  PixelOrder order(64);
  for (const std::size_t count : {16, 40, 8, 1, 64, 30, 30}) order.append(count);
  std::vector<std::size_t> sizes;
  for (std::size_t i = 0; i < order.num_batches(); ++i) sizes.push_back(order.batch(i).size());
  EXPECT_THAT(sizes, testing::ElementsAre(64, 1, 64, 60));
  const std::vector<std::uint32_t> slots = all_slots(order);
  ASSERT_EQ(slots.size(), 189u);
  for (std::uint32_t i = 0; i < slots.size(); ++i) ASSERT_EQ(slots[i], i);
}

// H: each slot comes once, pixels of a block in one batch and ascending, whichever pixels take part
// and wherever the tile begins (seeds 0 to 199).
TEST(PixelOrder, KeepsBlocksTogether) {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](int low, int high) {
      return low + static_cast<int>(random() % static_cast<std::uint32_t>(high - low));
    };
    const int x = draw(-20, 40), y = draw(-20, 40);
    const PixelRect rect{x, y, x + draw(1, 40), y + draw(1, 40)};
    const auto num_pixels = static_cast<std::size_t>(rect.area());
    RoundPixels some;
    for (std::size_t i = 0; i < num_pixels; ++i) {
      if (random() % 3 == 0) some.add(i, 1);
    }
    const PixelBlocks blocks(rect);
    for (const RoundPixels& pixels : {some, RoundPixels::all(num_pixels)}) {
      const PixelOrder order(rect, pixels, PixelOrder::Blocks::of_memory, 64);
      std::vector<std::uint32_t> slots = all_slots(order);
      std::set<std::size_t> done;
      for (std::size_t i = 0; i < order.num_batches(); ++i) {
        ASSERT_LE(order.batch(i).size(), 64u);
        std::set<std::size_t> here;
        std::uint32_t before = 0;
        std::size_t last = blocks.count();
        for (const std::uint32_t slot : order.batch(i)) {
          const std::size_t block = blocks.of(pixels.index(slot));
          if (block == last) {
            ASSERT_GT(slot, before);
          } else {
            ASSERT_TRUE(here.insert(block).second) << seed;
          }
          last = block;
          before = slot;
        }
        for (const std::size_t block : here) ASSERT_TRUE(done.insert(block).second) << seed;
      }
      std::ranges::sort(slots);
      ASSERT_EQ(slots.size(), pixels.size());
      for (std::uint32_t i = 0; i < slots.size(); ++i) ASSERT_EQ(slots[i], i);
    }
  }
}

// A block of the picture has the same pixels in whatever tile it lies whole.
TEST(PixelBlocks, BelongToThePicture) {
  const PixelBlocks blocks({-5, -8, 11, 3});
  EXPECT_EQ(blocks.columns(), 5);
  EXPECT_EQ(blocks.rows(), 3);
  EXPECT_EQ(blocks.pixels(0), (PixelRect{-5, -8, -4, -4}));
  EXPECT_EQ(blocks.pixels(6), (PixelRect{-4, -4, 0, 0}));
  EXPECT_EQ(blocks.at(-1, -1), 6u);
  EXPECT_EQ(blocks.of(0), 0u);
  EXPECT_EQ(blocks.pixels(14), (PixelRect{8, 0, 11, 3}));
}

}  // namespace
}  // namespace baton
