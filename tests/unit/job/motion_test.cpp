#include "common/job/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

JobSpec moving_camera(KeyCurve curve) {
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.motion.curve = curve;
  for (const auto& [frame, x] : {std::pair{1.0, 0.0f}, {3.0, 4.0f}, {7.0, 36.0f}})
    job.camera.keys.push_back({.frame = frame, .position = {x, 1, 9}, .look_at = {x, 0, 0}});
  return job;
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-5f) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Motion, BothCurvesMeetTheKeysAndHoldOutsideThem) {
  for (const KeyCurve curve : {KeyCurve::linear, KeyCurve::smooth}) {
    const JobSpec job = moving_camera(curve);
    EXPECT_EQ(camera_at(job, -5).position, (Vec3{0, 1, 9}));
    EXPECT_EQ(camera_at(job, 1).position, (Vec3{0, 1, 9}));
    EXPECT_EQ(camera_at(job, 3).look_at, (Vec3{4, 0, 0}));
    EXPECT_EQ(camera_at(job, 7).position, (Vec3{36, 1, 9}));
    EXPECT_EQ(camera_at(job, 99).position, (Vec3{36, 1, 9}));
    EXPECT_EQ(camera_at(job, 5).vertical_fov_deg, job.camera.vertical_fov_deg);
    EXPECT_TRUE(camera_at(job, 5).keys.empty());
  }
}

TEST(Motion, LinearIsAStraightLineAndSmoothFollowsAParabola) {
  EXPECT_FLOAT_EQ(camera_at(moving_camera(KeyCurve::linear), 5).position.x, 20);
  // x = (frame - 1)^2 / 1 at uneven keys: inner slopes are those of the parabola.
  JobSpec job = moving_camera(KeyCurve::smooth);
  job.camera.keys.push_back({.frame = 9, .position = {64, 1, 9}, .look_at = {64, 0, 0}});
  job.camera.keys[0].position.x = 0;
  for (const double frame : {3.5, 4.0, 5.0, 6.9})
    EXPECT_NEAR(camera_at(job, frame).position.x, (frame - 1) * (frame - 1), 1e-4);
}

TEST(Motion, TwoKeysOnTheSmoothCurveAreAStraightLine) {
  JobSpec job = moving_camera(KeyCurve::smooth);
  job.camera.keys.pop_back();
  EXPECT_FLOAT_EQ(camera_at(job, 2).position.x, 2);
}

TEST(Motion, AnglesAreNumbersAndQuaternionsTakeTheShortWay) {
  ObjectSpec object;
  object.keys = {{.frame = 1}, {.frame = 5}};
  object.keys[1].rotate_deg = {0, 360, 0};
  // A quarter turn about y takes z to x.
  expect_near(object_motion_at(object, KeyCurve::smooth, 2).point({0, 0, 1}), {1, 0, 0});

  object.keys[1].rotate_deg = {};
  object.keys[1].quaternion = {0, -2, 0, 0};  // half a turn about y, not unit
  const Vec3 halfway = object_motion_at(object, KeyCurve::linear, 3).point({0, 0, 1});
  EXPECT_NEAR(std::fabs(halfway.x), 1, 1e-6f);

  // The same rotation with the other sign is no way at all.
  object.keys[0].quaternion = {0.6f, 0, 0, 0.8f};
  object.keys[1].quaternion = {-0.6f, 0, 0, -0.8f};
  expect_near(object_motion_at(object, KeyCurve::linear, 3).point({0, 0, 1}),
              object_motion_at(object, KeyCurve::linear, 1).point({0, 0, 1}));
}

TEST(Motion, AnObjectIsScaledThenTurnedThenMoved) {
  ObjectSpec object;
  object.keys = {{.frame = 1,
                  .translate = {10, 0, 0},
                  .rotate_deg = {0, 0, 90},
                  .quaternion = {0, 0, 0, 1},
                  .scale = {2, 3, 4}}};
  expect_near(object_motion_at(object, KeyCurve::smooth, 8).point({1, 0, 0}), {10, 2, 0});
  EXPECT_EQ(object_motion_at(ObjectSpec{}, KeyCurve::smooth, 8), Transform{});
}

TEST(Motion, SaysWhatMovesAndWhetherThatIsSettled) {
  JobSpec job;
  job.sampling.method = Method::sequential;
  EXPECT_FALSE(moves(job));
  EXPECT_TRUE(is_settled(job));
  EXPECT_EQ(frames_per_run(job), job.state.checkpoint_every);
  job.motion.max_px = 7;
  EXPECT_EQ(history_reach_px(job), 0);

  job.scene.objects.push_back({.mesh = "m", .material = "m", .keys = {{.frame = 1}}});
  EXPECT_TRUE(moves(job));
  EXPECT_TRUE(is_settled(job));
  EXPECT_EQ(history_reach_px(job), 7);
  EXPECT_TRUE(shares_history(job));
  EXPECT_EQ(frames_per_run(job), 1);
  job.state.carry = false;
  EXPECT_EQ(frames_per_run(job), job.state.checkpoint_every);
  job.motion.max_px = 0;
  EXPECT_FALSE(is_settled(job));
  EXPECT_FALSE(make_job_document(job));
}

TEST(TileGrid, TilesNearATileAreThoseWithAPixelInReach) {
  const TileGrid grid({0, 0, 100, 60}, 32);  // 4 x 2 tiles
  EXPECT_THAT(grid.tiles_near(5, 0), ElementsAre(5));
  EXPECT_THAT(grid.tiles_near(5, 1), ElementsAre(0, 1, 2, 4, 5, 6));
  EXPECT_THAT(grid.tiles_near(3, 4), ElementsAre(2, 3, 6, 7));
  EXPECT_THAT(grid.tiles_near(3, 33), ElementsAre(1, 2, 3, 5, 6, 7));
  EXPECT_EQ(grid.tiles_near(0, 1 << 20).size(), 8u);
}

TEST(TileGrid, CutsARegionAtBlocksOfThePicture) {
  const TileGrid grid({10, 20, 50, 41}, 32);  // 2 x 1 tiles
  EXPECT_EQ(grid.count(), 2);
  EXPECT_EQ(grid.rect(0), (PixelRect{10, 20, 40, 41}));
  EXPECT_EQ(grid.rect(1), (PixelRect{40, 20, 50, 41}));
  const TileGrid overscan({-5, -16, 3, 0}, 8);  // 2 x 2
  EXPECT_EQ(overscan.count(), 4);
  EXPECT_EQ(overscan.rect(0), (PixelRect{-5, -16, 0, -8}));
  EXPECT_EQ(overscan.rect(3), (PixelRect{0, -8, 3, 0}));
  EXPECT_THAT(grid.tiles_near(1, 0), ElementsAre(1));
  EXPECT_THAT(grid.tiles_near(1, 1), ElementsAre(0, 1));
}

TEST(ImageSpec, ScalesARegionToWholePixels) {
  const ImageSpec image{.width = 641, .height = 360, .region = PixelRect{101, 50, 400, 249}};
  const ImageSpec quarter = scaled(image, 0.25);
  EXPECT_EQ(quarter.width, 160);
  EXPECT_EQ(quarter.height, 90);
  EXPECT_EQ(quarter.rendered(), (PixelRect{25, 12, 100, 63}));
  const ImageSpec dot = scaled(image, 0.0001);
  EXPECT_EQ(dot.rendered(), (PixelRect{0, 0, 1, 1}));
}

TEST(ImageSpec, ScalesOverscanToWholePixels) {
  const ImageSpec image{.width = 640, .height = 360, .overscan = {10, 0, 1, 4096}};
  EXPECT_EQ(scaled(image, 0.25).overscan, (Overscan{3, 0, 1, 1024}));
  EXPECT_EQ(scaled(image, 0.25).rendered(), (PixelRect{-3, 0, 161, 1114}));
}

Result<JobSpec> parse(const std::string& motion, const std::string& object = "") {
  return parse_job(
      R"({"name": "m", "environment": {"map": "a.exr"}, "scene": {"materials": {"m": {"type": "diffuse"}},
      "meshes": {"m": "m.obj"}, "objects": [{"mesh": "m", "material": "m")" +
          object + "}]}" + motion + "}",
      "job", "/");
}

TEST(MotionJson, ReadsBackWhatItWrites) {
  const Result<JobSpec> job = parse(
      R"(, "camera": {"keys": [{"frame": 1, "position": [0, 0, 5], "lookAt": [0, 0, 0], "verticalFovDeg": 30}]},
         "motion": {"curve": "linear", "maxPx": 9})",
      R"(, "keys": [{"frame": 2.5, "rotateDeg": [0, 90, 0], "quaternion": [0, 0, 1, 0], "scale": 2}])");
  ASSERT_TRUE(job) << job.error().message;
  EXPECT_EQ(job->camera.keys.at(0).vertical_fov_deg, 30.0f);
  EXPECT_EQ(job->scene.objects.at(0).keys.at(0).scale, (Vec3{2, 2, 2}));
  EXPECT_EQ(job->motion.max_px, 9);
  EXPECT_EQ(parse_job(to_json(*job), "again", "/").value(), *job);

  const Result<JobSpec> gltf = parse(R"(, "camera": {"gltf": {"file": "a.glb", "node": "eye"}})");
  ASSERT_TRUE(gltf) << gltf.error().message;
  EXPECT_EQ(gltf->camera.gltf->file, "/a.glb");
  EXPECT_EQ(parse_job(to_json(*gltf), "again", "/").value(), *gltf);
}

// A file says where its camera is; what the camera sees of that, the job may say.
TEST(MotionJson, CamerasOfFiles) {
  const std::string file = R"("gltf": {"file": "a.glb", "node": "eye"})";
  const auto camera = [&](const std::string& more) {
    return parse(R"(, "camera": {)" + file + more + "}");
  };
  const Result<JobSpec> wide = camera(R"(, "verticalFovDeg": 80, "projection": "perspective")");
  ASSERT_TRUE(wide) << wide.error().message;
  EXPECT_EQ(wide->camera.own_vertical_fov_deg, 80.0f);
  EXPECT_EQ(parse_job(to_json(*wide), "again", "/").value(), *wide);
  EXPECT_EQ(camera(R"(, "orthographicHeight": 3)")->camera.own_orthographic_height, 3.0f);
  const auto error = [&](const std::string& more) {
    const Result<JobSpec> job = camera(more);
    return job ? "none" : job.error().message;
  };
  for (const char* const key : {"position", "lookAt", "up"})
    EXPECT_THAT(error(std::string(", \"") + key + "\": [0, 1, 9]"),
                HasSubstr(std::string("$.camera.") + key + ": expected none, as the glTF file"));
  EXPECT_THAT(error(R"(, "projection": "orthographic")"),
              HasSubstr("$.camera.projection: expected orthographicHeight beside it"));
  EXPECT_THAT(error(R"(, "projection": "perspective")"),
              HasSubstr("$.camera.projection: expected verticalFovDeg beside it"));
  EXPECT_THAT(error(R"(, "verticalFovDeg": 80, "orthographicHeight": 3)"),
              HasSubstr("$.camera.orthographicHeight: expected either it or verticalFovDeg"));
}

// Smooth curves swing past keys, but an object that is not there stays so between them.
TEST(Motion, AScaleOfZeroStays) {
  ObjectSpec object;
  object.keys = {{.frame = 1},
                 {.frame = 3, .scale = {0, 0, 0}},
                 {.frame = 5, .scale = {0, 0, 0}},
                 {.frame = 7}};
  const auto width = [&](double frame) {
    return object_motion_at(object, KeyCurve::smooth, frame).linear.m[0];
  };
  EXPECT_EQ(width(1), 1);
  EXPECT_GT(width(2), 0);
  for (const double frame : {3.0, 3.5, 4.0, 4.9, 5.0}) EXPECT_EQ(width(frame), 0) << frame;
  EXPECT_GT(width(6), 0);
}

TEST(MotionJson, NamesWhatIsWrong) {
  const auto error = [](const std::string& motion, const std::string& object = "") {
    const Result<JobSpec> job = parse(motion, object);
    return job ? std::string() : job.error().message;
  };
  EXPECT_THAT(error(R"(, "camera": {"keys": [{"frame": 1, "lookAt": [0, 0, 0]}]})"),
              HasSubstr("$.camera.keys[0].position: expected a value, got none"));
  EXPECT_THAT(
      error(R"(, "camera": {"keys": [{"frame": 1, "position": [1, 1, 1], "lookAt": [1, 1, 1]}]})"),
      HasSubstr("$.camera.keys[0].lookAt: expected another point than position"));
  EXPECT_THAT(
      error("", R"(, "keys": [{"frame": 2}, {"frame": 2}])"),
      HasSubstr(
          "$.scene.objects[0].keys: expected ascending frames without duplicates, got 2 after 2"));
  EXPECT_THAT(error("", R"(, "keys": [{"frame": 2, "quaternion": [0, 0, 0, 0]}])"),
              HasSubstr("quaternion: expected a rotation"));
  EXPECT_THAT(error("", R"(, "keys": [{"frame": 2}], "gltf": {"file": "a.glb", "node": "n"})"),
              HasSubstr("gltf: expected either keys or gltf, got both"));
  EXPECT_THAT(error("", R"(, "gltf": {"file": "a.obj", "node": "n"})"),
              HasSubstr("ends in .gltf .glb"));
  EXPECT_THAT(error(R"(, "motion": {"maxPx": -1})"),
              HasSubstr("$.motion.maxPx: expected an integer in [0, 32768]"));
}

}  // namespace
}  // namespace baton
