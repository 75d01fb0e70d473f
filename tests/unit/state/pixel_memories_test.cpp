#include "common/state/pixel_memories.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "common/state/bin_kernels.h"

namespace baton {
namespace {

/// Pixels without and with bins, some of which rays have reached.
PixelMemories open_memories(std::uint32_t seed, std::size_t num_pixels = 20) {
  std::mt19937 random(seed);
  PixelMemories memories;
  memories.assign(num_pixels);
  for (std::size_t i = 0; i < num_pixels; ++i) {
    PixelMemory& memory = memories[i];
    memory.all_rays = static_cast<VisibilityCell>(random());
    memory.outcomes = static_cast<std::uint16_t>(i % 4);
    memory.light_noise = static_cast<std::uint16_t>(random() % 100);
    memory.lobe_noise = static_cast<std::uint16_t>(random() % 100);
    if (memory.outcomes != PixelMemory::kSawBoth) continue;
    for (auto n = random() % 300; n > 0; --n)
      memory.bins.make()[random() % VisibilityBins::kCount] = static_cast<VisibilityCell>(random());
    memory.bins.make();
  }
  return memories;
}

TEST(PixelMemories, RememberTheSamePackedAndOpen) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const PixelMemories before = open_memories(seed);
    PixelMemories after = before;
    after.pack();
    EXPECT_TRUE(after.is_packed());
    EXPECT_EQ(after, before);
    EXPECT_EQ(after.size(), before.size());
    EXPECT_LT(after.size_bytes(), before.size_bytes());
    after.open();
    EXPECT_FALSE(after.is_packed());
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], before[i]) << i;
  }
}

// None, one, all, and what lies between.
TEST(PixelMemories, BinsAreCompressedInOrder) {
  std::mt19937 random(7);
  for (std::uint32_t most = 0; most <= 256; most += most < 4 || most > 252 ? 1 : 9) {
    VisibilityBins bins;
    bins.make();
    for (std::size_t bin = 0; bin < VisibilityBins::kCount; ++bin) {
      if (random() % VisibilityBins::kCount < most)
        bins.make()[bin] = static_cast<VisibilityCell>(bin % 2 == 0 ? 1u << random() % 16 : 65535);
    }
    std::vector<VisibilityCell> expected;
    PixelMemories::BinMask expected_mask{};
    for (std::size_t bin = 0; bin < VisibilityBins::kCount; ++bin) {
      if (bins.data()[bin] == 0) continue;
      expected.push_back(bins.data()[bin]);
      expected_mask[bin / 64] |= std::uint64_t{1} << bin % 64;
    }
    PixelMemories::BinMask mask{};
    std::vector<VisibilityCell> cells(VisibilityBins::kCount);
    cells.resize(compress_bins(bins.data(), mask, cells.data()));
    EXPECT_EQ(cells, expected) << most;
    EXPECT_EQ(mask, expected_mask) << most;
  }
}

// The target has had other bins.
TEST(PixelMemories, APixelIsCopiedOutOfEitherForm) {
  const PixelMemories open = open_memories(1), packed = open.to_packed(), other = open_memories(2);
  for (std::size_t i = 0; i < open.size(); ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      PixelMemory to = other[j];
      packed.copy_to(i, to);
      EXPECT_EQ(to, open[i]) << i << " over " << j;
      open.copy_to(i, to);
      EXPECT_EQ(to, open[i]) << i;
    }
  }
}

TEST(PixelMemories, AnyDifferenceIsOne) {
  const PixelMemories before = open_memories(3);
  PixelMemories other = before;
  other[3].bins.make()[17] ^= 1;
  EXPECT_NE(other, before);
  EXPECT_NE(other.to_packed(), before);
  other = before;
  other[2].lobe_noise ^= 1;
  EXPECT_NE(other.to_packed(), before.to_packed());
}

TEST(PixelMemories, NoPixelsAreEmpty) {
  PixelMemories none;
  EXPECT_TRUE(none.empty());
  none.pack();
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none, PixelMemories());
}

}  // namespace
}  // namespace baton
