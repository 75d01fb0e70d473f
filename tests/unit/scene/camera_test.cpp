#include "worker/scene/camera.h"

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

}  // namespace
}  // namespace baton
