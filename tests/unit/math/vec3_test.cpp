#include "common/math/vec3.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/math/pixel_rect.h"

namespace baton {
namespace {

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-6f) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Vec3, NormalizeNeverYieldsNan) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  expect_near(normalize({3, 0, 4}), {0.6f, 0, 0.8f});
  EXPECT_EQ(normalize({0, 0, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(normalize({kInfinity, 0, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(normalize({std::numeric_limits<float>::quiet_NaN(), 0, 0}), (Vec3{0, 0, 1}));
}

TEST(Vec3, ReflectMirrorsAboutTheNormal) {
  expect_near(reflect(normalize({1, 0, 1}), {0, 0, 1}), normalize({-1, 0, 1}));
}

TEST(Frame, IsOrthonormalAndRightHandedForAnyNormal) {
  const Vec3 normals[] = {{0, 0, 1},
                          {0, 0, -1},
                          {1, 0, 0},
                          {0, -1, 0},
                          normalize({1, 2, -3}),
                          normalize({1e-4f, 0, -1})};
  for (const Vec3& n : normals) {
    const Frame frame(n);
    EXPECT_NEAR(length(frame.x), 1, 1e-5f);
    EXPECT_NEAR(length(frame.y), 1, 1e-5f);
    EXPECT_NEAR(dot(frame.x, frame.y), 0, 1e-5f);
    EXPECT_NEAR(dot(frame.x, n), 0, 1e-5f);
    expect_near(cross(frame.x, frame.y), n, 1e-5f);
    expect_near(frame.to_local(frame.to_world({0.1f, 0.2f, 0.3f})), {0.1f, 0.2f, 0.3f}, 1e-5f);
  }
}

TEST(Rotation, IsRightHandedAndItsTransposeUndoesIt) {
  const Mat3 quarter = rotation_about({0, 2, 0}, 90);
  expect_near(quarter * Vec3{0, 0, 1}, {1, 0, 0});
  expect_near(quarter.transposed() * (quarter * Vec3{1, 2, 3}), {1, 2, 3}, 1e-5f);
  expect_near((quarter * quarter) * Vec3{0, 0, 1}, {0, 0, -1});
}

TEST(PixelRect, IsHalfOpen) {
  constexpr PixelRect rect{2, 3, 5, 4};
  EXPECT_EQ(rect.area(), 3);
  EXPECT_TRUE(rect.contains(2, 3));
  EXPECT_FALSE(rect.contains(5, 3));
  EXPECT_FALSE(rect.contains(2, 4));
}

TEST(PixelRect, FitsWithinItsImageWhenNotEmpty) {
  EXPECT_TRUE((PixelRect{0, 0, 8, 8}.fits_within(8)));
  EXPECT_FALSE((PixelRect{0, 0, 9, 8}.fits_within(8)));
  EXPECT_FALSE((PixelRect{-1, 0, 8, 8}.fits_within(8)));
  EXPECT_FALSE((PixelRect{3, 0, 3, 8}.fits_within(8)));
  EXPECT_TRUE((PixelRect{-2, 0, 8, 10}.fits_within(8, 2)));
  EXPECT_FALSE((PixelRect{-3, 0, 8, 8}.fits_within(8, 2)));
  EXPECT_FALSE((PixelRect{0, 0, 8, 11}.fits_within(8, 2)));
}

}  // namespace
}  // namespace baton
