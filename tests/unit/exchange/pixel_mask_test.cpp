#include "worker/exchange/pixel_mask.h"

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

TEST(PixelMask, RanksCountRowByRow) {
  PixelMask some({3, 1, 80, 4}), more(some.rect());
  for (const std::int32_t x : {4, 35, 67, 68, 79}) some.set(x, 2);
  more.set(3, 3);
  some.add(more);
  const std::vector<std::int32_t> ranks = some.ranks();
  std::int32_t expected = 0;
  for (std::int32_t y = 1; y < 4; ++y) {
    for (std::int32_t x = 3; x < 80; ++x)
      ASSERT_EQ(ranks[some.index(x, y)], some.at(x, y) ? expected++ : -1) << x << "," << y;
  }
  EXPECT_EQ(expected, 6);
}

TEST(SquareMembers, AreTheOtherMaskedPixelsOfTheSquare) {
  const PixelRect image{0, 0, 23, 17};
  PixelMask mask({2, 1, 21, 17});
  for (std::int32_t y = 1; y < 17; ++y) {
    for (std::int32_t x = 2; x < 21; ++x) {
      if ((x * 7 + y * 5) % 3 != 0) mask.set(x, y);
    }
  }
  const SquarePartitions partitions(image, 5, 6, Rng({.job_seed = 3}, PassId::partition));
  const std::vector<std::int32_t> names = mask.ranks();
  for (std::int32_t c = 0; c < partitions.count(); ++c) {
    SquareMembers squares;
    for (std::int32_t y = 1; y < 17; ++y) {
      squares.move_to(mask, partitions, c, y, names);
      for (std::int32_t x = 2; x < 21; ++x) {
        if (!mask.at(x, y)) continue;
        const SquareMembers::Others others = squares.others(x, y);
        std::vector<std::uint32_t> got, expected;
        for (std::uint32_t k = 0; k < others.count; ++k) got.push_back(others.pick(k));
        const PixelRect square = partitions.square(c, x, y);
        for (std::int32_t v = square.y0; v < square.y1; ++v) {
          for (std::int32_t u = square.x0; u < square.x1; ++u) {
            if (mask.at(u, v) && (u != x || v != y))
              expected.push_back(static_cast<std::uint32_t>(names[mask.index(u, v)]));
          }
        }
        ASSERT_EQ(got, expected) << c << ": " << x << "," << y;
      }
    }
  }
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

void expect_partitions_of(const PixelRect& image) {
  const SquarePartitions partitions(image, 5, 30, Rng({.job_seed = 9}, PassId::partition));
  for (std::int32_t c = 0; c < partitions.count(); ++c) {
    for (std::int32_t y = image.y0; y < image.y1; ++y) {
      for (std::int32_t x = image.x0; x < image.x1; ++x) {
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

TEST(SquarePartitions, EachIsAPartitionOfTheImage) {
  expect_partitions_of({0, 0, 13, 8});
  expect_partitions_of({-7, -11, 9, 3});
}

TEST(SquarePartitions, OverscanMovesNoSquare) {
  const Rng rng({.job_seed = 9}, PassId::partition);
  const SquarePartitions plain({0, 0, 13, 18}, 5, 25, rng), wide({-3, -9, 14, 30}, 5, 25, rng);
  for (std::int32_t c = 0; c < plain.count(); ++c) {
    EXPECT_EQ(wide.square(c, 6, 6), plain.square(c, 6, 6));
    EXPECT_EQ(common_part(wide.square(c, 0, 0), {0, 0, 13, 18}), plain.square(c, 0, 0));
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
