#include "common/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>

namespace baton {
namespace {

void expect_direction(const Vec3& actual, const Vec3& expected) {
  EXPECT_NEAR(actual.x, expected.x, 1e-6f);
  EXPECT_NEAR(actual.y, expected.y, 1e-6f);
  EXPECT_NEAR(actual.z, expected.z, 1e-6f);
}

TEST(Camera, CentreOfTheImageLooksAtTheTarget) {
  const CameraSpec spec{.position = {1, 2, 3}, .look_at = {-4, 0, 7}};
  const Ray ray = Camera(spec, 64, 48).ray(32, 24);
  EXPECT_EQ(ray.origin, spec.position);
  expect_direction(ray.direction, normalize(spec.look_at - spec.position));
}

TEST(Camera, XGoesRightAndYGoesDown) {
  const Camera camera({.position = {0, 0, 5}, .look_at = {0, 0, 0}}, 64, 64);
  EXPECT_GT(camera.ray(60, 32).direction.x, 0);
  EXPECT_LT(camera.ray(32, 60).direction.y, 0);
}

TEST(Camera, FieldOfViewSpansTheHeight) {
  const Camera camera({.position = {0, 0, 0}, .look_at = {0, 0, -1}, .vertical_fov_deg = 90}, 200,
                      100);
  expect_direction(camera.ray(100, 0).direction, normalize({0, 1, -1}));
  expect_direction(camera.ray(100, 100).direction, normalize({0, -1, -1}));
  expect_direction(camera.ray(200, 50).direction, normalize({2, 0, -1}));
}

TEST(Camera, MatricesSayWhatRaysSay) {
  const CameraSpec spec{
      .position = {1, 2, 3}, .look_at = {-4, 0, 7}, .up = {0.2f, 1, 0}, .vertical_fov_deg = 50};
  const Camera camera(spec, 64, 48);
  const PixelRect shown{8, 12, 40, 48};
  const Matrix4 to_camera = camera.world_to_camera(), to_ndc = camera.world_to_ndc(shown);
  const auto times = [](const Vec3& p, const Matrix4& m, std::size_t c) {
    return p.x * m[c] + p.y * m[4 + c] + p.z * m[8 + c] + m[12 + c];
  };
  for (const float x : {0.0f, 17.0f, 64.0f}) {
    for (const float y : {0.0f, 30.5f, 48.0f}) {
      const Ray ray = camera.ray(x, y);
      const Vec3 point = ray.origin + ray.direction * 3;
      const Vec3 seen{times(point, to_camera, 0), times(point, to_camera, 1),
                      times(point, to_camera, 2)};
      EXPECT_NEAR(length(seen), 3, 1e-5f);
      EXPECT_LT(seen.z, 0);
      EXPECT_NEAR(times(point, to_camera, 3), 1, 1e-6f);
      const float w = times(point, to_ndc, 3);
      EXPECT_NEAR(w, -seen.z, 1e-5f);
      EXPECT_NEAR(times(point, to_ndc, 0) / w, (x - 8) / 16 - 1, 1e-5f);
      EXPECT_NEAR(times(point, to_ndc, 1) / w, 1 - (y - 12) / 18, 1e-5f);
      EXPECT_NEAR(times(point, to_ndc, 2), 1, 1e-5f);
    }
  }
}

TEST(Camera, DegenerateUpStillGivesAFrame) {
  for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{0, -2, 0}, Vec3{0, 0, 0}, Vec3{1e-9f, 1, 0}}) {
    const Camera camera({.position = {0, 5, 0}, .look_at = {0, 0, 0}, .up = up}, 64, 64);
    expect_direction(camera.ray(32, 32).direction, {0, -1, 0});
    const Vec3 corner = camera.ray(0, 0).direction;
    EXPECT_NEAR(length(corner), 1, 1e-6f);
    EXPECT_GT(length(cross(corner, {0, -1, 0})), 0.3f);
  }
  EXPECT_NEAR(
      length(Camera({.position = {1, 1, 1}, .look_at = {1, 1, 1}}, 4, 4).ray(1, 1).direction), 1,
      1e-6f);
}

TEST(Camera, ShiftMovesThePictureAndKeepsItsPlane) {
  CameraSpec spec{.position = {0, 0, 0}, .look_at = {0, 0, -1}, .vertical_fov_deg = 90};
  spec.shift = {0.5f, 0.25f};
  const Camera camera(spec, 200, 100);
  // One picture height is two units of the plane ahead: its centre is one to the right, half up.
  expect_direction(camera.ray(100, 50).direction, normalize({1, 0.5f, -1}));
  expect_direction(camera.ray(100, 0).direction, normalize({1, 1.5f, -1}));
  const auto place = camera.project({0, 0, -3});
  ASSERT_TRUE(place);
  EXPECT_NEAR((*place)[0], 50, 1e-4f);
  EXPECT_NEAR((*place)[1], 75, 1e-4f);
}

TEST(Camera, OrthographicRaysAreParallel) {
  CameraSpec spec{.position = {0, 0, 5}, .look_at = {0, 0, 0}};
  spec.projection = Projection::orthographic;
  spec.orthographic_height = 4;
  const Camera camera(spec, 200, 100);
  const Ray ray = camera.ray(150, 0);
  expect_direction(ray.direction, {0, 0, -1});
  expect_direction(ray.origin, {2, 2, 5});
  EXPECT_FLOAT_EQ(camera.pixel_width(ray.direction, 7), 0.04f);
  for (const float depth : {1.0f, 9.0f}) {
    const auto place = camera.project(ray.origin + ray.direction * depth);
    ASSERT_TRUE(place);
    EXPECT_NEAR((*place)[0], 150, 1e-3f);
    EXPECT_NEAR((*place)[1], 0, 1e-3f);
  }
  EXPECT_FALSE(camera.project({0, 0, 6}));
  const Matrix4 m = camera.world_to_ndc({0, 0, 200, 100});
  EXPECT_NEAR(2 * m[0] + 2 * m[4] + m[12], 0.5f, 1e-5f);
  EXPECT_NEAR(2 * m[1] + 2 * m[5] + m[13], 1, 1e-5f);
  EXPECT_NEAR(1 * m[10] + m[14], 4, 1e-5f) << "z of a point 4 ahead";
  EXPECT_EQ(m[15], 1);
}

// All rays of a place in the picture meet in focus, whatever the point of the lens; there they are
// spread evenly over a disk.
TEST(Camera, ALensIsSharpAtItsFocus) {
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    CameraSpec spec{.position = {0, 1, 6}, .look_at = {0, 0, 0}, .vertical_fov_deg = 50};
    spec.projection = projection;
    spec.shift = {0.1f, -0.2f};
    spec.aperture = 0.5f;
    spec.focus_distance = 4;
    const Camera camera(spec, 64, 48);
    ASSERT_TRUE(camera.has_lens());
    const Ray middle = camera.ray(10, 40);
    const Vec3 ahead = normalize(spec.look_at - spec.position);
    const Vec3 focus = middle.origin + middle.direction * (4 / dot(middle.direction, ahead));
    double squares = 0;
    constexpr int kSide = 16;
    for (int i = 0; i < kSide * kSide; ++i) {
      const Ray ray = camera.ray(10, 40,
                                 {(static_cast<float>(i % kSide) + 0.5f) / kSide,
                                  (static_cast<float>(i / kSide) + 0.5f) / kSide});
      const Vec3 offset = ray.origin - middle.origin;
      EXPECT_LE(length(offset), 0.2501f);
      EXPECT_NEAR(dot(offset, ahead), 0, 1e-5f);
      EXPECT_NEAR(length(cross(focus - ray.origin, ray.direction)), 0, 1e-5f);
      squares += double{dot(offset, offset)} / (kSide * kSide);
    }
    EXPECT_NEAR(squares, 0.5 * 0.25 * 0.25, 1e-3)
        << "the mean square of a disk is half its radius'";
  }
}

}  // namespace
}  // namespace baton
