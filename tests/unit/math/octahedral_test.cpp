#include "common/math/octahedral.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/math/philox.h"

namespace baton {
namespace {

/// Angle between unit vectors in degrees, exact for small ones.
double angle_degrees(const Vec3& a, const Vec3& b) {
  const double cx = double{a.y} * b.z - double{a.z} * b.y;
  const double cy = double{a.z} * b.x - double{a.x} * b.z;
  const double cz = double{a.x} * b.y - double{a.y} * b.x;
  const double cosine = double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
  return std::atan2(std::sqrt(cx * cx + cy * cy + cz * cz), cosine) * 180 / 3.14159265358979323846;
}

Vec3 uniform_direction(std::uint32_t index) {
  const auto u = Rng({.job_seed = 1, .frame = 0, .pixel = 0}, PassId::reference).uniforms(0, index);
  const float z = 1 - 2 * u[0];
  const float radius = std::sqrt(std::max(0.0f, 1 - z * z));
  const float phi = 2 * kPi * u[1];
  return {radius * std::cos(phi), radius * std::sin(phi), z};
}

OctDirection code_of(std::uint32_t x, std::uint32_t y) { return x | (y << 16); }
bool on_rim(OctDirection code) {
  const auto edge = [](std::uint32_t half) { return half == 0 || half == 0xFFFF; };
  return edge(code & 0xFFFF) || edge(code >> 16);
}

// The worst case is a cell's corner at a face centre: sqrt(6) / 65535 / (1 / sqrt(3)) radians =
// 0.00371 degrees.
TEST(Octahedral, EncodingMovesADirectionByLessThanTheStatedAngle) {
  double worst = 0;
  for (std::uint32_t i = 0; i < 1000000; ++i) {
    const Vec3 w = uniform_direction(i);
    worst = std::max(worst, angle_degrees(w, decode_octahedral(encode_octahedral(w))));
  }
  EXPECT_LT(worst, 0.0038);
  EXPECT_GT(worst, 0.0030) << "the bound is meant to be tight";
}

TEST(Octahedral, AxesAndDiagonalsStayClose) {
  for (const float x : {-1.0f, -0.0f, 0.0f, 1.0f}) {
    for (const float y : {-1.0f, -0.0f, 0.0f, 1.0f}) {
      for (const float z : {-1.0f, -0.0f, 0.0f, 1.0f}) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3 w = normalize({x, y, z});
        EXPECT_LT(angle_degrees(w, decode_octahedral(encode_octahedral(w))), 0.0038)
            << x << ' ' << y << ' ' << z;
      }
    }
  }
}

TEST(Octahedral, DecodedDirectionsAreUnit) {
  for (std::uint32_t i = 0; i < 100000; ++i) {
    const Vec3 w = decode_octahedral(Philox4x32::block({i, 0, 0, 0}, 1)[0]);
    ASSERT_NEAR(length(w), 1.0f, 2e-7f);
  }
}

// All 2^32 codes were tried once with the same result; here a random sample and the
// critical lines: the rim, its neighbours, the fold (|u| + |v| = 1) and the middle.
TEST(Octahedral, EncodeUndoesDecodeInsideTheRim) {
  const auto check = [](OctDirection code) {
    if (on_rim(code)) return;
    ASSERT_EQ(encode_octahedral(decode_octahedral(code)), code) << std::hex << code;
  };
  for (std::uint32_t i = 0; i < 1000000; ++i) check(Philox4x32::block({i, 0, 0, 0}, 2)[0]);
  for (std::uint32_t a = 0; a <= 0xFFFF; ++a) {
    const std::uint32_t fold = (a + 0x8000) & 0xFFFF;
    for (const std::uint32_t b :
         {0x0001u, 0xFFFEu, 0x7FFFu, 0x8000u, fold, 0xFFFF - fold, a, 0xFFFF - a}) {
      check(code_of(a, b));
      check(code_of(b, a));
    }
  }
}

TEST(Octahedral, OnTheRimTwoCodesMeanOneDirectionAndEncodingIsStable) {
  int num_changed = 0;
  const auto check = [&](OctDirection code) {
    const Vec3 w = decode_octahedral(code);
    const OctDirection encoded = encode_octahedral(w);
    ASSERT_LT(angle_degrees(w, decode_octahedral(encoded)), 1e-4) << std::hex << code;
    ASSERT_EQ(encode_octahedral(decode_octahedral(encoded)), encoded) << std::hex << code;
    num_changed += encoded != code;
  };
  for (std::uint32_t a = 0; a <= 0xFFFF; ++a) {
    check(code_of(a, 0));
    check(code_of(a, 0xFFFF));
    if (a == 0 || a == 0xFFFF) continue;
    check(code_of(0, a));
    check(code_of(0xFFFF, a));
  }
  // Half of the 4 x 65534 codes of the sides, and 3 of the 4 corners.
  EXPECT_EQ(num_changed, 2 * 65534 + 3);
}

}  // namespace
}  // namespace baton
