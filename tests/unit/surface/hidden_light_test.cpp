#include "worker/surface/hidden_light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/pose.h"
#include "tests/support/alive_box.h"
#include "tests/support/image_files.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

HiddenCone hidden(const JobSpec& job, int frame = 1) {
  const auto scene = load_scene(job);
  EXPECT_TRUE(scene.ok());
  return HiddenLight(job, *scene).at(FrameNumber(frame));
}

/// Whether a ray ends on the ground.
bool ends_on_ground(const GroundSpec& ground, const Vec3& origin, const Vec3& w) {
  if (w.y >= 0) return false;
  const Vec3 end = origin + w * ((ground.height - origin.y) / w.y);
  return std::max(std::fabs(end.x), std::fabs(end.z)) <= 0.5f * ground.size;
}

/// A direction at an angle from straight down.
Vec3 aslant(float angle, float around) {
  return {std::sin(angle) * std::cos(around), -std::cos(angle), std::sin(angle) * std::sin(around)};
}

TEST(HiddenLight, EndsOnTheGroundFromEveryPointAndNotFarBeyond) {
  JobSpec job = test::box_job();
  job.scene.ground->size = 9;
  const auto scene = load_scene(job);
  const HiddenCone cone = HiddenLight(job, *scene).at(FrameNumber(1));
  EXPECT_EQ(cone.axis, (std::array<float, 3>{0, -1, 0}));
  ASSERT_GT(cone.angle, 1);
  int missed = 0;
  for (const Instance& instance : scene->instances) {
    for (const Vec3& position : scene->meshes[instance.mesh].positions) {
      const Vec3 point = instance.to_world.point(position);
      if (std::max(std::fabs(point.x), std::fabs(point.z)) > 2) continue;  // the ground's own
      for (int k = 0; k < 64; ++k) {
        const float around = 0.1f * static_cast<float>(k);
        EXPECT_TRUE(ends_on_ground(*job.scene.ground, point, aslant(cone.angle, around)));
        missed +=
            ends_on_ground(*job.scene.ground, point, aslant(cone.angle + 0.12f, around)) ? 0 : 1;
      }
    }
  }
  EXPECT_GT(missed, 0) << "no wider cone would do";
}

TEST(HiddenLight, IsThatOfEachFrame) {
  JobSpec job = test::box_job();
  const auto degrees = [&](int frame) { return hidden(job, frame).angle * 180 / kPi; };
  EXPECT_NEAR(degrees(1), 85, 1e-3f) << "of 86.9, atan(18.6 / 1)";
  job.scene.objects[1].keys = {{.frame = 3}, {.frame = 8.5, .translate = {0, 9, 0}}};
  job.motion.max_px = 4;
  EXPECT_NEAR(degrees(3), 85, 1e-3f);
  EXPECT_NEAR(degrees(9), 60, 1e-3f) << "of 61.7, atan(18.6 / 10)";
  EXPECT_LT(degrees(6), degrees(3));
  EXPECT_GT(degrees(6), degrees(9));

  job.camera.keys = {{.frame = 9, .position = job.camera.position, .look_at = {0, 0, 0}},
                     {.frame = 20, .position = {0, -1, 4}, .look_at = {0, 0, 0}}};
  EXPECT_NEAR(degrees(9), 60, 1e-3f);
  EXPECT_EQ(degrees(20), 0) << "the camera has dived";
}

TEST(HiddenLight, IsThatOfWhatHasGrown) {
  JobSpec job = test::box_job();
  const float rest = hidden(job).angle;
  job.frames = test::frame_numbers(4);
  test::set_deforming(job, 0, 9);
  EXPECT_EQ(hidden(job, 1).angle, rest);
  EXPECT_LT(hidden(job, 4).angle, rest);
}

TEST(HiddenLight, TurnsWithTheMap) {
  JobSpec job = test::box_job();
  const float angle = hidden(job).angle;
  job.environment.rotation_deg_per_frame = 3;
  EXPECT_EQ(hidden(job).angle, angle) << "about the vertical";
  EXPECT_EQ(hidden(job).axis, (std::array<float, 3>{0, -1, 0}));

  job.environment.rotation_axis = {0, 0, 1};
  EXPECT_EQ(hidden(job).angle, 0) << "the map's own down changes";
  job.environment.rotation_deg_per_frame = 0;
  job.environment.rotation_start_deg = 90;
  const HiddenCone tilted = hidden(job);
  EXPECT_EQ(tilted.angle, angle);
  const Vec3 down = environment_at(job.environment, FrameNumber(7)).rotation *
                    Vec3{tilted.axis[0], tilted.axis[1], tilted.axis[2]};
  EXPECT_NEAR(down.y, -1, 1e-6f);

  job.environment.rotation_keys = {{1, 30}, {9, 31}};
  EXPECT_EQ(hidden(job).angle, 0);
}

TEST(HiddenLight, IsNoneWhereTheGroundIsNotAlwaysInTheWay) {
  const JobSpec job = test::box_job();
  ASSERT_GT(hidden(job).angle, 1.4f) << "85 degrees";
  const auto expect_none = [&](const char* why, const auto& change) {
    JobSpec changed = job;
    change(changed);
    EXPECT_EQ(hidden(changed).angle, 0) << why;
  };
  expect_none("no ground", [](JobSpec& j) { j.scene.ground.reset(); });
  expect_none("a catcher casts nothing", [](JobSpec& j) { j.scene.ground->catcher = true; });
  expect_none("a camera below", [](JobSpec& j) { j.camera.position.y = -1; });
  expect_none("a camera beside it", [](JobSpec& j) { j.camera.position = {25, 3, 0}; });
  expect_none("a lens that reaches below it", [](JobSpec& j) { j.camera.aperture = 4; });
  expect_none("a picture plane that does", [](JobSpec& j) {
    j.camera.projection = Projection::orthographic;
    j.camera.orthographic_height = 5;
  });
  expect_none("an object beyond its edge", [](JobSpec& j) { j.scene.objects[0].translate.x = 21; });
  expect_none("holes", [](JobSpec& j) {
    MaterialSpec& ground = j.scene.materials["ground"];
    ground.color_texture =
        TextureSpec{.file = test::write_targa("ground.tga", 2, 1, 4, {9, 9, 9, 255, 9, 9, 9, 0})};
    ground.alpha_cutoff = 0.5f;
  });
}

}  // namespace
}  // namespace baton
