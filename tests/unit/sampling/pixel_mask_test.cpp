#include "worker/sampling/pixel_mask.h"

#include <gtest/gtest.h>

#include <set>

namespace baton {
namespace {

TEST(PixelMask, OutsideIsNo) {
  PixelMask mask({2, 3, 5, 6});
  mask.set(4, 5);
  EXPECT_TRUE(mask.at(4, 5));
  EXPECT_FALSE(mask.at(2, 3));
  EXPECT_FALSE(mask.at(5, 5));
  EXPECT_FALSE(mask.at(4, 2));
}

TEST(PixelMask, RowsOfBitsCrossWords) {
  PixelMask mask({3, 0, 203, 2});
  for (std::int32_t x = 3; x < 203; ++x) {
    if (x % 3 == 0) mask.set(x, 1);
  }
  for (std::int32_t x0 = 3; x0 + 16 <= 203; ++x0) {
    const std::uint32_t bits = mask.row_bits(x0, x0 + 16, 1);
    for (std::int32_t x = x0; x < x0 + 16; ++x)
      ASSERT_EQ(bits >> (x - x0) & 1, x % 3 == 0 ? 1u : 0u);
    EXPECT_EQ(mask.row_bits(x0, x0 + 16, 0), 0u);
  }
}

TEST(MaskedSquare, ListsTheOthersRowByRow) {
  PixelMask mask({0, 0, 9, 9});
  for (const auto& [x, y] : {std::pair{2, 2}, {4, 2}, {3, 3}, {6, 6}, {7, 2}}) mask.set(x, y);
  const MaskedSquare square(mask, {2, 2, 7, 7}, 3, 3);
  ASSERT_EQ(square.count(), 3u);
  EXPECT_EQ(square.pick(0).x, 2);
  EXPECT_EQ(square.pick(1).x, 4);
  EXPECT_EQ(square.pick(2).x, 6);
  EXPECT_EQ(square.pick(2).y, 6);
  EXPECT_EQ(MaskedSquare(mask, {7, 0, 12, 5}, 8, 4).count(), 1u);
}

TEST(Dilate, GrowsASquareWithinWhatIsAllowed) {
  const PixelRect rect{0, 0, 6, 5};
  PixelMask mask(rect);
  mask.set(2, 2);
  PixelMask allowed(rect);
  for (std::int32_t y = 0; y < 5; ++y) {
    for (std::int32_t x = 0; x < 6; ++x) {
      if (x != 3) allowed.set(x, y);
    }
  }
  for (const std::int32_t radius : {0, 1, 2}) {
    const PixelMask grown = dilate(mask, radius, allowed, rect);
    for (std::int32_t y = 0; y < 5; ++y) {
      for (std::int32_t x = 0; x < 6; ++x) {
        EXPECT_EQ(grown.at(x, y), std::abs(x - 2) <= radius && std::abs(y - 2) <= radius && x != 3);
      }
    }
  }
}

TEST(SquarePartitions, EachIsAPartitionOfTheImage) {
  const PixelRect image{0, 0, 13, 8};
  const SquarePartitions partitions(image, 5, 30, Rng({.job_seed = 9}, PassId::partition));
  for (std::int32_t c = 0; c < partitions.count(); ++c) {
    for (std::int32_t y = 0; y < 8; ++y) {
      for (std::int32_t x = 0; x < 13; ++x) {
        const PixelRect square = partitions.square(c, x, y);
        ASSERT_TRUE(square.contains(x, y));
        EXPECT_LE(square.width(), 5);
        EXPECT_LE(square.height(), 5);
        EXPECT_TRUE(image.contains(square.x0, square.y0) &&
                    image.contains(square.x1 - 1, square.y1 - 1));
        EXPECT_EQ(partitions.square(c, square.x0, square.y0), square);
        EXPECT_EQ(partitions.square(c, square.x1 - 1, square.y1 - 1), square);
      }
    }
  }
}

TEST(SquarePartitions, OffsetsDifferUntilAllAreUsed) {
  const SquarePartitions partitions({0, 0, 100, 100}, 5, 25,
                                    Rng({.job_seed = 4}, PassId::partition));
  std::set<std::pair<std::int32_t, std::int32_t>> corners;
  for (std::int32_t c = 0; c < 25; ++c) {
    const PixelRect square = partitions.square(c, 50, 50);
    corners.emplace(square.x0, square.y0);
  }
  EXPECT_EQ(corners.size(), 25u);
}

}  // namespace
}  // namespace baton
