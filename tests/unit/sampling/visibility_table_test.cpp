#include "worker/sampling/visibility_table.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/remembered.h"

namespace baton {
namespace {

const OctDirection kUp = encode_octahedral(normalize({0.1f, 1, 0.1f}));
const OctDirection kDown = encode_octahedral(normalize({0.1f, -1, 0.1f}));
const OctDirection kSide = encode_octahedral(normalize({1, 0.2f, 0}));

TEST(VisibilityTable, EveryBinIsTheBinOfSomeDirection) {
  std::set<std::size_t> bins;
  for (std::uint32_t i = 0; i < 40000; ++i) {
    for (const bool is_lamp : {false, true}) bins.insert(visibility_bin(i * 2654435761u, is_lamp));
  }
  EXPECT_EQ(bins.size(), BlockMemory::kCount);
  EXPECT_LT(*bins.rbegin(), BlockMemory::kCount);
}

TEST(VisibilityTable, KnowsNothingAtFirst) {
  EXPECT_FALSE(table_of({}).knows_rays);
  for (const OctDirection code : {kUp, kDown, kSide})
    EXPECT_EQ(expected_visibility({}, code), 0.5f);
}

TEST(VisibilityTable, ExpectsTheSameEverywhereWhileRaysAgree) {
  for (const bool free : {true, false}) {
    BlockMemory memory;
    for (int i = 0; i < 50; ++i) remember_ray(memory, 17, free);
    EXPECT_TRUE(table_of(memory).is_uniform);
    // That comes close to certainty but never reaches it.
    const float expected = expected_visibility(memory, kUp);
    EXPECT_GT(free ? 1 - expected : expected, 0.0f);
    EXPECT_LT(free ? 1 - expected : expected, 0.02f);
  }
}

TEST(VisibilityTable, TellsBinsApart) {
  BlockMemory memory;
  for (int i = 0; i < 100; ++i) {
    remember_ray(memory, visibility_bin(kUp), true);
    remember_ray(memory, visibility_bin(kSide), false);
  }
  EXPECT_GT(expected_visibility(memory, kUp), 0.95f);
  EXPECT_LT(expected_visibility(memory, kSide), 0.05f);
  EXPECT_NEAR(expected_visibility(memory, kDown), 0.5f, 0.06f) << "of which nothing is known";
}

// What hides a lamp says little of the sky around it, and nothing of the rest: of what no ray has
// seen is not expected that it is hidden as all else is.
TEST(VisibilityTable, AHiddenLampHidesNothingElse) {
  BlockMemory memory;
  for (int i = 0; i < 200; ++i) remember_ray(memory, visibility_bin(kUp, true), false);
  remember_ray(memory, visibility_bin(kSide), true);
  EXPECT_LT(expected_visibility(memory, kUp, true), 0.03f);
  EXPECT_GT(expected_visibility(memory, kUp), 0.5f);
  EXPECT_GT(expected_visibility(memory, kDown), 0.5f);
}

// Few outcomes of a bin weigh little beside what the bins around it know.
TEST(VisibilityTable, FewOutcomesAreNotTrusted) {
  BlockMemory memory;
  const std::size_t bin = visibility_bin(kUp), beside = bin ^ 1;
  for (int i = 0; i < 100; ++i) remember_ray(memory, beside, true);
  remember_ray(memory, bin, false);
  EXPECT_GT(expected_visibility(memory, kUp), 0.7f);
  for (int i = 0; i < 100; ++i) remember_ray(memory, bin, false);
  EXPECT_LT(expected_visibility(memory, kUp), 0.1f);
}

TEST(VisibilityTable, IsReadBinByBin) {
  BlockMemory memory;
  for (std::size_t bin = 0; bin < BlockMemory::kCount; ++bin)
    memory.cells[bin] = {200, static_cast<std::uint8_t>(bin * 37 % 200)};
  const VisibilityTable table = table_of(memory);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    for (const bool is_lamp : {false, true}) {
      const OctDirection code = i * 2654435761u;
      const std::size_t bin = visibility_bin(code, is_lamp);
      ASSERT_EQ(expected_visibility(memory, code, is_lamp), table.expected[bin]);
      ASSERT_NEAR(table.expected[bin], static_cast<float>(bin * 37 % 200) / 200, 0.03f) << bin;
    }
  }
}

TEST(RememberRays, FullBinsGoOnWithHalfOfTheirRays) {
  BlockMemory memory;
  for (int i = 0; i < 1000; ++i) remember_ray(memory, 5, i % 2 == 0);
  const VisibilityCell cell = memory.cells[5];
  EXPECT_GE(cell.seen, 127);
  EXPECT_NEAR(cell.free, cell.seen / 2.0, 2);
  for (int i = 0; i < 1000; ++i) remember_ray(memory, 5, true);
  EXPECT_GE(memory.cells[5].free, memory.cells[5].seen - 3) << "what no longer holds is forgotten";
  EXPECT_LE(memory.cells[5].free, memory.cells[5].seen);
}

TEST(RememberRays, TakesSixtyFourAtOnce) {
  std::vector<std::uint16_t> bins(64);
  for (std::size_t i = 0; i < 64; ++i) bins[i] = static_cast<std::uint16_t>(i % 3 + 300);
  BlockMemory memory;
  PixelMemory pixel;
  remember_rays(bins, 0x8000000000000001u, memory, pixel);
  EXPECT_EQ(memory.cells[300], (VisibilityCell{22, 2}));
  EXPECT_EQ(memory.cells[301], (VisibilityCell{21, 0}));
  EXPECT_EQ(memory.cells[302], (VisibilityCell{21, 0}));
}

/// A ray of which the block expects V^ in 1 / RayTally::kRay.
std::uint16_t tag_of(std::size_t bin, unsigned expected) {
  return static_cast<std::uint16_t>(bin | expected << RayTag::kBinBits);
}

// The block is in the light, one of its pixels is not.
TEST(PixelVisibility, IsWhatOwnRaysFoundBesideTheBlock) {
  BlockMemory block;
  for (int i = 0; i < 200; ++i) remember_ray(block, 7, i % 10 != 0);
  PixelMemory dark, bright;
  for (int i = 0; i < 10; ++i) {
    const std::uint16_t tag[] = {tag_of(7, 114)};
    remember_rays(tag, 0, block, dark);
    remember_rays(tag, 1, block, bright);
  }
  const VisibilityTable table = table_of(block);
  const PixelVisibility of_dark(table, dark, 6), of_bright(table, bright, 6);
  EXPECT_NEAR(of_dark.share[0], 6 / (6 + 10 * 114.0 / 127), 1e-4);
  EXPECT_NEAR(of_bright.share[0], (6 + 10) / (6 + 10 * 114.0 / 127), 1e-4);
  EXPECT_EQ(of_dark.share[1], 1.0f) << "of lamps it knows nothing";
  for (int i = 0; i < 5000; ++i) {
    const std::uint16_t tag[] = {tag_of(7, 114)};
    remember_rays(tag, 0, block, dark);
  }
  EXPECT_LT(PixelVisibility(table, dark, 6).share[0], 0.06f);
  EXPECT_LE(dark.rays[0].expected, RayTally::kMost);
}

// However much more light a pixel finds than its block, nothing is certain.
TEST(PixelVisibility, IsNeverCertain) {
  using namespace HWY_NAMESPACE;
  BlockMemory block;
  for (int i = 0; i < 200; ++i) remember_ray(block, 7, i % 2 == 0);
  PixelMemory own;
  own.rays[0] = {100, RayTally::kMost};
  const VisibilityTable table = table_of(block);
  const PixelVisibility pixel(table, own, 6);
  const PoolTuning tuning;
  EXPECT_EQ(hn::GetLane(RememberedLanes(tuning, pixel).Look(hn::Set(DI(), 7)).expected),
            kMostVisible);
}

}  // namespace
}  // namespace baton
