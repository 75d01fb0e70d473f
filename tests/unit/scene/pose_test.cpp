#include "common/scene/pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/job/motion.h"
#include "common/job/text/frame_range.h"
#include "common/scene/settle/settle_motion.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using testing::HasSubstr;

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-4f) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

/// A cube at (5, 1, 0) that turns about its own place and rises, seen by a camera that looks along
/// -z.
JobSpec turning_job() {
  JobSpec job;
  job.frames = parse_frames("1-3").value();
  job.image = {.width = 200, .height = 100};
  job.camera = {
      .position = {0, 0, 10}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 90};
  job.scene.materials["grey"] = {};
  job.scene.meshes["cube"] = {test::write_test_file("pose_cube.off", test::kCubeOff), true};
  job.scene.objects.push_back({.mesh = "cube", .material = "grey", .translate = {5, 1, 0}});
  job.scene.objects[0].keys = {{.frame = 1},
                               {.frame = 3, .translate = {0, 2, 0}, .rotate_deg = {0, 180, 0}}};
  return job;
}

TEST(Camera, ProjectionIsTheInverseOfTheRay) {
  const Camera camera({.position = {1, 2, 3}, .look_at = {-4, 0, 1}, .vertical_fov_deg = 50}, 320,
                      180);
  for (const auto& [x, y] :
       {std::pair{0.0f, 0.0f}, {17.25f, 100.5f}, {319.0f, 3.0f}, {-50.0f, 400.0f}}) {
    const Ray ray = camera.ray(x, y);
    const auto at = camera.project(ray.origin + ray.direction * 7);
    ASSERT_TRUE(at);
    EXPECT_NEAR((*at)[0], x, 2e-3f);
    EXPECT_NEAR((*at)[1], y, 2e-3f);
    EXPECT_FALSE(camera.project(ray.origin - ray.direction));
  }
}

TEST(Pose, AnObjectTurnsAboutItsPlaceAndTheRestStays) {
  JobSpec job = turning_job();
  job.scene.objects.push_back({.mesh = "cube", .material = "grey"});
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  const Pose first = pose_at(*scene, job, 1);
  const Pose last = pose_at(*scene, job, 3);
  EXPECT_EQ(first.instances[0].to_world, scene->instances[0].to_world);
  EXPECT_EQ(last.instances[1].to_world, scene->instances[1].to_world);
  EXPECT_FALSE(last.instances[1].moves());
  expect_near(first.instances[0].to_world.point({0.5f, 0, 0}), {5.5f, 1, 0});
  expect_near(last.instances[0].to_world.point({0.5f, 0, 0}), {4.5f, 3, 0});
  EXPECT_EQ(first.camera, last.camera);
}

TEST(Pose, PointsAndNormalsAreCarriedWithTheirObject) {
  JobSpec job = turning_job();
  job.scene.objects[0].scale = {1, 2, 3};
  job.scene.objects[0].keys[1].scale = {2, 1, 1};
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  const Pose now = pose_at(*scene, job, 2), before = pose_at(*scene, job, 1);
  const Instance &from = now.instances[0], &to = before.instances[0];
  const Vec3 local{0.3f, -0.2f, 0.4f};
  expect_near(carry_point(*scene, now, before, {.world = from.to_world.point(local)}),
              to.to_world.point(local));
  const Vec3 normal = normalize({0.2f, 0.9f, -0.4f});
  expect_near(
      carry_normal(*scene, now, before, {.world = normalize(from.normal_to_world * normal)}),
      normalize(to.normal_to_world * normal));
}

TEST(Pose, WhatHasNoVolumeIsNotThere) {
  JobSpec job = turning_job();
  job.scene.objects[0].keys[1].scale = {1, 0, 1};
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  EXPECT_FALSE(pose_at(*scene, job, 1).instances[0].is_absent);
  EXPECT_FALSE(pose_at(*scene, job, 2).instances[0].is_absent);
  EXPECT_TRUE(pose_at(*scene, job, 3).instances[0].is_absent);
  // So thin that float32 does not hold the way back.
  job.scene.objects[0].keys[1].scale = {1, 1e-14f, 1};
  EXPECT_TRUE(pose_at(*scene, job, 3).instances[0].is_absent);
  job.scene.objects[0].keys[1].scale = {1, 1e-9f, 1};
  EXPECT_FALSE(pose_at(*scene, job, 3).instances[0].is_absent);
  job.scene.objects[0].keys[1].scale = {1, 0, 1};
  // Nothing that is there moves.
  job.frames = parse_frames("1,3").value();
  EXPECT_EQ(settle_motion(job)->motion.max_px, 1);
}

TEST(SettleMotion, MeasuresTheLargestStepInTheImage) {
  // The camera shifts by 0.5 a frame; the cube's near face is 9 ahead: 50 pixels span the
  // tangent 1.
  JobSpec job = turning_job();
  job.scene.objects[0].keys.clear();
  job.scene.objects[0].translate = {0, 0, 0};
  job.camera.keys = {{.frame = 1, .position = {0, 0, 10}, .look_at = {0, 0, 0}},
                     {.frame = 3, .position = {1, 0, 10}, .look_at = {1, 0, 0}}};
  const Result<JobSpec> settled = settle_motion(job);
  ASSERT_TRUE(settled) << settled.error().message;
  EXPECT_TRUE(is_settled(*settled));
  const float step = 0.5f / 9.0f * 50;
  EXPECT_EQ(settled->motion.max_px, static_cast<int>(std::ceil(1.1f * step)) + 1);

  // The ground comes nearer than its corners say.
  job.scene.ground = GroundSpec{.material = "grey", .height = -2, .size = 100};
  EXPECT_GT(settle_motion(job)->motion.max_px, settled->motion.max_px);

  // What is said or stands still is left alone.
  job.motion.max_px = 3;
  EXPECT_EQ(settle_motion(job)->motion.max_px, 3);
  job.motion.max_px = 0;
  job.camera.keys.clear();
  EXPECT_EQ(settle_motion(job)->motion.max_px, 0);
}

/// A node "arm" below a turned parent "base", moved from (0, 0, 0) to (4, 0, 0) in one second, and
/// a camera "eye" that moves alike; "rest" does not.
std::string animated_gltf() {
  // Times 0, 1 and places (0,0,0), (4,0,0) as little-endian floats in base 64.
  return test::write_test_file(
      "animated.gltf",
      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 2, 3]}],
    "nodes": [{"name": "base", "children": [1], "rotation": [0, 0, 0.70710678, 0.70710678]}, {"name": "arm"},
              {"name": "eye", "camera": 0, "translation": [0, 1, 5]}, {"name": "rest"}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5}}],
    "animations": [{"channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
                    "samplers": [{"input": 0, "output": 1}]},
                   {"channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
                    "samplers": [{"input": 0, "output": 1}]}],
    "buffers": [{"byteLength": 32, "uri": "data:application/octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIBAAAAAAAAAAAA="}],
    "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 24}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
                  {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"}]})");
}

TEST(SettleMotion, TakesNodesAndCamerasOutOfGltf) {
  JobSpec job = turning_job();
  const std::string file = animated_gltf();
  job.scene.objects[0].keys.clear();
  job.scene.objects[0].gltf = GltfMotion{.file = file, .node = "arm", .fps = 2, .start_frame = 1};
  job.camera.gltf = GltfMotion{.file = file, .node = "eye", .fps = 2, .start_frame = 1};
  const Result<JobSpec> settled = settle_motion(job);
  ASSERT_TRUE(settled) << settled.error().message;
  // Half a second at frame 2; the parent turns x into y.
  const auto motion = [&](double frame) {
    return object_motion_at(settled->scene.objects[0], settled->motion.curve, frame);
  };
  expect_near(motion(2).offset, {0, 2, 0});
  expect_near(motion(3).offset, {0, 4, 0});
  expect_near(motion(2).linear * Vec3{1, 0, 0}, {0, 1, 0});
  const CameraSpec camera = camera_at(*settled, 3);
  expect_near(camera.position, {4, 0, 0});
  expect_near(normalize(camera.look_at - camera.position), {0, 0, -1});
  EXPECT_NEAR(settled->camera.vertical_fov_deg, 0.8f * 180 / kPi, 1e-3f);
}

TEST(SettleMotion, NamesTheFileThatIsWrong) {
  JobSpec job = turning_job();
  job.scene.objects[0].keys.clear();
  job.scene.objects[0].gltf = GltfMotion{.file = animated_gltf(), .node = "leg"};
  EXPECT_THAT(settle_motion(job).error().message, HasSubstr("animated.gltf: no node \"leg\""));
  job.scene.objects[0].gltf->node = "rest";
  EXPECT_THAT(settle_motion(job).error().message, HasSubstr("node \"rest\": no animation moves"));
  job.camera.gltf = GltfMotion{.file = animated_gltf(), .node = "arm"};
  EXPECT_THAT(settle_motion(job).error().message, HasSubstr("node \"arm\" holds no camera"));
  job.camera.gltf->file = "/nowhere.gltf";
  EXPECT_THAT(settle_motion(job).error().message, HasSubstr("/nowhere.gltf: missing"));
  job.camera.gltf->file = test::write_test_file("broken.gltf", "{\"asset\": ");
  EXPECT_THAT(settle_motion(job).error().message, HasSubstr("broken.gltf: not a glTF file"));
}

}  // namespace
}  // namespace baton
