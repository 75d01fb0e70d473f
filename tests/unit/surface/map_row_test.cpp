#include "worker/surface/map_row.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace baton {
namespace {

constexpr double kPi64 = std::numbers::pi;

/// Edges of a row, and what a function is along them.
struct Case {
  double top, bottom, upper, lower;
};

constexpr Case kCases[] = {
    {0, kPi64, 1, 1},                // a map of one row
    {0, kPi64, 0, 3},                //
    {0, kPi64 / 16, 2, 2},           // at a pole
    {0, kPi64 / 16, 0, 1},           // where nothing is at the pole
    {kPi64 * 15 / 16, kPi64, 1, 0},  //
    {1.0, 1.2, 5, 0},                //
    {1.5, 1.5 + 1e-4, 1, 7},         // of a fine map
    {2e-4, 4e-4, 1, 1000},           // of a fine map, near a pole
};

/// Integral over the row down to `place`, over the width of the map, by the midpoint rule.
double integral_to(const Case& c, double place) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double at = (i + 0.5) / kSteps * place;
    sum += ((1 - at) * c.upper + at * c.lower) * std::sin(c.top + at * (c.bottom - c.top));
  }
  return sum * place / kSteps * (c.bottom - c.top) * 2 * kPi64;
}

TEST(MapRow, IntegratesWhatIsLinearDown) {
  for (const Case& c : kCases) {
    const MapRow row(c.top, c.bottom, 8);
    const double whole = integral_to(c, 1);
    EXPECT_NEAR(8 * row.integral(c.upper, c.lower), whole, 1e-7 * whole)
        << c.top << ", " << c.bottom;
  }
}

TEST(MapRow, FindsThePlaceOfAShareOfTheIntegral) {
  for (const Case& c : kCases) {
    const MapRow row(c.top, c.bottom, 8);
    const double whole = integral_to(c, 1);
    EXPECT_NEAR(row.place(c.upper, c.lower, 0), 0, 1e-3);
    for (const double share : {0.001, 0.1, 0.37, 0.5, 0.8, 0.999, 1.0}) {
      const double place = row.place(c.upper, c.lower, share);
      EXPECT_NEAR(integral_to(c, place) / whole, share, 1e-6)
          << c.top << ", " << c.bottom << ", " << c.upper << ", " << c.lower;
    }
  }
}

TEST(MapRow, PlacesInLinearDensities) {
  EXPECT_EQ(place_in_linear(2, 2, 0.25), 0.25);
  EXPECT_NEAR(place_in_linear(0, 1, 0.25), 0.5, 1e-12);
  EXPECT_NEAR(place_in_linear(1, 0, 0.75), 0.5, 1e-12);
  EXPECT_NEAR(place_in_linear(1, 3, 0.375), 0.5, 1e-12);
  EXPECT_EQ(place_in_linear(0, 0, 0.3), 0.3);
  EXPECT_EQ(place_in_linear(1e-30, 1e30, 1), 1);
}

TEST(MapRow, KeepsADistanceAsTheLatticeRounds) {
  EXPECT_NEAR(MapRow(kPi64 / 2, kPi64 / 2 + 0.01, 1000).margin_down(), 6.7e-3, 1e-5);
  EXPECT_NEAR(MapRow(kPi64 / 2, kPi64 / 2 + 0.01, 1000).margin_across(),
              6.7e-5 * 1000 / (2 * kPi64), 1e-5);
  EXPECT_EQ(MapRow(0, 1e-4, 1000).margin_across(), 0.5);
}

}  // namespace
}  // namespace baton
