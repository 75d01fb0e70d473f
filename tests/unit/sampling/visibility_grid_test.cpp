#include "worker/sampling/visibility_grid.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "common/math/octahedral.h"

namespace baton {
namespace {

using Grid = std::array<VisibilityCell, kVisibilityCells>;

TEST(VisibilityGrid, EveryBinIsTheBinOfSomeDirection) {
  std::set<std::size_t> bins;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    bins.insert(visibility_bin(i * 2654435761u));
  }
  EXPECT_EQ(bins.size(), kVisibilityBins);
  EXPECT_LT(*bins.rbegin(), kVisibilityBins);
}

TEST(VisibilityGrid, KnowsNothingAtFirst) {
  const Grid grid{};
  for (std::size_t bin = 0; bin < kVisibilityBins; ++bin) EXPECT_EQ(free_share(grid, bin), 0.5f);
}

TEST(VisibilityGrid, KeepsNoBinsWhileRaysAgree) {
  for (const bool free : {true, false}) {
    Grid grid{};
    for (int i = 0; i < 50; ++i) remember_ray(grid, 77, free);
    for (std::size_t bin = 0; bin < kVisibilityBins; ++bin) EXPECT_EQ(grid[bin], 0);
    EXPECT_EQ(grid[kVisibilityOutcomes], free ? kSawFree : kSawBlocked);
    // All bins answer with the summary, which comes close to certainty but never reaches it.
    const float doubt = free ? 1 - free_share(grid, 3) : free_share(grid, 3);
    EXPECT_GT(doubt, 0.0f);
    EXPECT_LT(doubt, 0.02f);
  }
}

TEST(VisibilityGrid, TellsBinsApartOnceRaysDisagree) {
  Grid grid{};
  const std::size_t open = visibility_bin(encode_octahedral({0, 1, 0}));
  const std::size_t wall = visibility_bin(encode_octahedral(normalize({1, 0.2f, 0})));
  for (int i = 0; i < 40; ++i) {
    remember_ray(grid, open, true);
    remember_ray(grid, wall, false);
  }
  EXPECT_GT(free_share(grid, open), 0.98f);
  EXPECT_LT(free_share(grid, wall), 0.02f);
  EXPECT_NEAR(free_share(grid, visibility_bin(encode_octahedral({0, -1, 0}))), 0.5f, 0.06f);
}

TEST(VisibilityGrid, ForgetsWhatNoLongerHolds) {
  Grid grid{};
  const std::size_t w = 77;
  remember_ray(grid, w, false);
  for (int i = 0; i < 100; ++i) remember_ray(grid, w, true);
  for (int i = 0; i < 60; ++i) remember_ray(grid, w, false);
  EXPECT_LT(free_share(grid, w), 0.05f);
}

}  // namespace
}  // namespace baton
