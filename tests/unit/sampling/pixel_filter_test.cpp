#include "worker/sampling/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/math/philox.h"
#include "tests/support/chi_square.h"

namespace baton {
namespace {

constexpr std::size_t kCells = 60;  ///< along either axis, over [-3, 4) pixels
constexpr std::size_t kSamples = 2000000;

std::size_t cell_of(double position) {
  return static_cast<std::size_t>((position + 3) / 7 * static_cast<double>(kCells));
}

/// p-value of positions that are drawn from one filter, as if they were of another; along an axis.
double p_value(PixelFilter drawn, PixelFilter wanted, std::size_t axis) {
  std::vector<double> observed(kCells), expected(kCells);
  const Rng rng({.job_seed = 3}, PassId::reference);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const auto u = rng.uniforms(0, i);
    observed[cell_of(double{filter_position(drawn, {u[0], u[1]})[axis]})] += 1;
  }
  constexpr std::size_t kSteps = 200;
  double sum = 0;
  for (std::size_t i = 0; i < kCells * kSteps; ++i) {
    const double position = (static_cast<double>(i) + 0.5) / (kCells * kSteps) * 7 - 3;
    const double weight = filter_weight(wanted, position - 0.5);
    expected[cell_of(position)] += weight;
    sum += weight;
  }
  for (double& e : expected) e *= static_cast<double>(kSamples) / sum;
  return test::chi_square_test(observed, expected).p_value;
}

// Hypothesis: positions have the filter's density along either axis. 2 million of them, 60 cells;
// four chi-square tests at level 1e-3 with Sidak. They see another filter, and a linear table of
// 4096 equally probable positions, which spreads the tails.
TEST(PixelFilter, PositionsFollowIt) {
  const double level = test::sidak_level(1e-3, 4);
  for (const PixelFilter filter : {PixelFilter::gaussian, PixelFilter::blackman_harris}) {
    for (const std::size_t axis : {0u, 1u})
      EXPECT_GT(p_value(filter, filter, axis), level) << static_cast<int>(filter);
  }
  EXPECT_LT(p_value(PixelFilter::gaussian, PixelFilter::blackman_harris, 0), 1e-9);
  EXPECT_LT(p_value(PixelFilter::box, PixelFilter::gaussian, 1), 1e-9);
}

// Strata of the unit square stay strata: the first half of u is the left half of the filter.
TEST(PixelFilter, IsMonotonousAndSymmetric) {
  for (const PixelFilter filter :
       {PixelFilter::box, PixelFilter::gaussian, PixelFilter::blackman_harris}) {
    const auto radius = static_cast<float>(filter_radius(filter));
    EXPECT_NEAR(filter_position(filter, {0.5f, 0.5f})[0], 0.5f, 1e-3f);
    EXPECT_NEAR(filter_position(filter, {0, 0})[1], 0.5f - radius, 1e-3f);
    EXPECT_LE(filter_position(filter, {0x1.fffffep-1f, 0})[0], 0.5f + radius);
    float last = -10;
    for (int i = 1; i < 100; ++i) {
      const float u = static_cast<float>(i) / 100;
      const float position = filter_position(filter, {u, 0})[0];
      EXPECT_GT(position, last);
      EXPECT_NEAR(position - 0.5f, 0.5f - filter_position(filter, {1 - u, 0})[0], 1e-2f) << u;
      last = position;
    }
  }
}

// (3 + u) / 4, the place of a site in the last of four rows, rounds to 1 for the largest u.
TEST(PixelFilterEdge, OneIsWithinTheFilter) {
  for (const PixelFilter filter : {PixelFilter::gaussian, PixelFilter::blackman_harris}) {
    const auto [x, y] = filter_position(filter, {1.0f, 1.0f});
    const auto edge = static_cast<float>(0.5 + filter_radius(filter));
    EXPECT_GT(x, 0.5 + 0.8 * filter_radius(filter));  // float sums end before the last cells
    EXPECT_LE(x, edge);
    EXPECT_EQ(x, y);
  }
}

}  // namespace
}  // namespace baton
