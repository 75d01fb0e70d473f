#include "common/math/hilbert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <vector>

namespace baton {
namespace {

/// The cells of a coarse grid of 2^k x 2^k, k = 1 ... 5, by their place on the curve.
class Hilbert : public testing::TestWithParam<std::uint32_t> {
 protected:
  std::vector<std::array<int, 3>> cells() const {
    const std::uint32_t side = 1u << GetParam();
    const std::uint32_t size = 65536 / side;
    std::vector<std::array<int, 3>> out;
    for (std::uint32_t y = 0; y < side; ++y) {
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::uint32_t place = hilbert_index(x * size, y * size) / size / size;
        out.push_back({static_cast<int>(place), static_cast<int>(x), static_cast<int>(y)});
      }
    }
    std::sort(out.begin(), out.end());
    return out;
  }
};

TEST_P(Hilbert, VisitsEveryCellOnceAndStepsToANeighbour) {
  const auto path = cells();
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(path[i][0], static_cast<int>(i));
    if (i == 0) continue;
    EXPECT_EQ(std::abs(path[i][1] - path[i - 1][1]) + std::abs(path[i][2] - path[i - 1][2]), 1);
  }
}

TEST_P(Hilbert, AQuarterOfTheCurveIsASquare) {
  const auto path = cells();
  const int half = 1 << (GetParam() - 1);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto& first = path[i / (path.size() / 4) * (path.size() / 4)];
    EXPECT_EQ(path[i][1] / half, first[1] / half);
    EXPECT_EQ(path[i][2] / half, first[2] / half);
  }
}

INSTANTIATE_TEST_SUITE_P(Sides, Hilbert, testing::Range(1u, 6u));

}  // namespace
}  // namespace baton
