#include "worker/sampling/visibility_memory.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/remembered.h"

namespace baton {
namespace {

const OctDirection kUp = encode_octahedral({0, 1, 0});
const OctDirection kDown = encode_octahedral({0, -1, 0});
const OctDirection kSide = encode_octahedral(normalize({1, 0.2f, 0}));

TEST(VisibilityMemory, EveryBinIsTheBinOfSomeDirection) {
  std::set<std::size_t> bins;
  for (std::uint32_t i = 0; i < 20000; ++i) bins.insert(visibility_bin(i * 2654435761u));
  EXPECT_EQ(bins.size(), VisibilityBins::kCount);
  EXPECT_LT(*bins.rbegin(), VisibilityBins::kCount);
}

TEST(VisibilityMemory, KnowsNothingAtFirst) {
  for (const OctDirection code : {kUp, kDown, kSide})
    EXPECT_NEAR(expected_visibility({}, code), 0.5f, 2e-4f);
}

TEST(VisibilityMemory, KeepsNoBinsWhileRaysAgree) {
  for (const bool free : {true, false}) {
    PixelMemory memory;
    for (int i = 0; i < 50; ++i) remember_ray(memory, 17, free);
    EXPECT_EQ(memory.bins, VisibilityBins());
    EXPECT_EQ(memory.outcomes, free ? PixelMemory::kSawFree : PixelMemory::kSawBlocked);
    // Every direction gets the share of all rays, which comes close to certainty but never reaches
    // it.
    const float expected = expected_visibility(memory, kUp);
    EXPECT_GT(free ? 1 - expected : expected, 0.0f);
    EXPECT_LT(free ? 1 - expected : expected, 0.02f);
  }
}

TEST(VisibilityMemory, TellsBinsApartOnceRaysDisagree) {
  PixelMemory memory;
  for (int i = 0; i < 40; ++i) {
    remember_ray(memory, visibility_bin(kUp), true);
    remember_ray(memory, visibility_bin(kSide), false);
  }
  EXPECT_GT(expected_visibility(memory, kUp), 0.98f);
  EXPECT_LT(expected_visibility(memory, kSide), 0.02f);
  EXPECT_NEAR(expected_visibility(memory, kDown), 0.5f, 0.06f);
}

TEST(VisibilityMemory, ForgetsWhatNoLongerHolds) {
  PixelMemory memory;
  const std::size_t bin = visibility_bin(kUp);
  remember_ray(memory, bin, false);
  for (int i = 0; i < 100; ++i) remember_ray(memory, bin, true);
  for (int i = 0; i < 60; ++i) remember_ray(memory, bin, false);
  EXPECT_LT(expected_visibility(memory, kUp), 0.05f);
}

// All eight lanes, and the last bin, whose load reaches past the bins.
TEST(VisibilityMemory, IsReadBinByBin) {
  PixelMemory memory;
  memory.outcomes = PixelMemory::kSawBoth;
  memory.all_rays = 100 << 4 | 15;
  for (std::size_t bin = 0; bin < VisibilityBins::kCount; ++bin)
    memory.bins.cells[bin] = static_cast<VisibilityCell>(bin << 10 | bin % 3);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const OctDirection code = i * 2654435761u;
    const std::size_t bin = visibility_bin(code);
    const float cell = bin % 3 == 0 ? 100.0f : static_cast<float>(bin << 6);
    ASSERT_NEAR(expected_visibility(memory, code), (cell + 0.5f) / 4096, 1e-6f) << bin;
  }
}

}  // namespace
}  // namespace baton
