#include "worker/scene/hidden_light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/image_files.h"
#include "tests/support/small_scene.h"
#include "worker/scene/pose.h"

namespace baton {
namespace {

HiddenCone hidden(const JobSpec& job) {
  const auto scene = load_scene(job);
  EXPECT_TRUE(scene.ok());
  return hidden_light(job, *scene);
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
  const HiddenCone cone = hidden_light(job, *scene);
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
            ends_on_ground(*job.scene.ground, point, aslant(cone.angle + 0.05f, around)) ? 0 : 1;
      }
    }
  }
  EXPECT_GT(missed, 0) << "no wider cone would do";
}

TEST(HiddenLight, LooksAtAllFramesFromTheFirstKeyToTheLast) {
  JobSpec job = test::box_job();
  const float at_rest = hidden(job).angle;
  job.scene.objects[1].keys = {{.frame = 3}, {.frame = 8.5, .translate = {0, 9, 0}}};
  job.motion.max_px = 4;
  const float in_motion = hidden(job).angle;
  EXPECT_NEAR(std::tan(at_rest), 20 / 1.0f, 2);
  EXPECT_NEAR(std::tan(in_motion), 20 / 10.0f, 0.3f);
  job.frames = {1, 2};
  EXPECT_EQ(hidden(job).angle, in_motion) << "whatever is rendered of the shot";

  job.camera.keys = {{.frame = 1, .position = job.camera.position, .look_at = {0, 0, 0}},
                     {.frame = 20, .position = {0, -1, 4}, .look_at = {0, 0, 0}}};
  EXPECT_EQ(hidden(job).angle, 0) << "a camera that dives";
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
  const Vec3 down = environment_at(job.environment, 7).rotation *
                    Vec3{tilted.axis[0], tilted.axis[1], tilted.axis[2]};
  EXPECT_NEAR(down.y, -1, 1e-6f);

  job.environment.rotation_keys = {{1, 30}, {9, 30}};
  EXPECT_EQ(hidden(job).angle, angle) << "keys of one value";
  job.environment.rotation_keys[1].value = 31;
  EXPECT_EQ(hidden(job).angle, 0);
}

TEST(HiddenLight, IsNoneWhereTheGroundIsNotAlwaysInTheWay) {
  const JobSpec job = test::box_job();
  ASSERT_GT(hidden(job).angle, 1.4f);
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
  expect_none("all is below it", [](JobSpec& j) { j.scene.ground->height = 1.2f; });
  expect_none("holes", [](JobSpec& j) {
    MaterialSpec& ground = j.scene.materials["ground"];
    ground.color_texture =
        TextureSpec{.file = test::write_targa("ground.tga", 2, 1, 4, {9, 9, 9, 255, 9, 9, 9, 0})};
    ground.alpha_cutoff = 0.5f;
  });
}

}  // namespace
}  // namespace baton
