// Which key of a glTF file a frame shows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/job/motion.h"
#include "common/job/text/frame_range.h"
#include "common/scene/gltf/node_motion.h"
#include "common/scene/pose.h"
#include "common/scene/scene_warnings.h"
#include "common/scene/settle/animations.h"
#include "tests/support/gltf_jobs.h"

namespace baton {
namespace {

using test::GltfWriter;

/// How exporters make the time of a frame.
using TimeOf = float (*)(int frame, double fps);
constexpr TimeOf kRounded = [](int frame, double fps) { return static_cast<float>(frame / fps); };
constexpr TimeOf kMultiplied = [](int frame, double fps) {
  return static_cast<float>(frame) * (1 / static_cast<float>(fps));
};
constexpr TimeOf kRational = [](int frame, double fps) {  // 24000/1001 for 23.976
  return static_cast<float>(frame / (std::round(fps) * 1000 / 1001));
};

constexpr int kFrames = 600;

/// Two nodes with a mesh of a morph target, one above the other, and a camera below the first; on
/// frame n translation is (n, 0, 0), the lower node's scale n % 2, its weight n.
std::string stepped_glb(double fps, TimeOf time_of) {
  std::vector<float> times, places, scales, weights;
  for (int n = 0; n < kFrames; ++n) {
    const auto value = static_cast<float>(n);
    times.push_back(time_of(n, fps));
    places.insert(places.end(), {value, 0, 0});
    const float scale = n % 2 == 0 ? 0.0f : 1.0f;
    scales.insert(scales.end(), {scale, scale, scale});
    weights.push_back(value);
  }
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(times, "SCALAR", 1);
  w.add(places, "VEC3", 3);
  w.add(scales, "VEC3", 3);
  w.add(weights, "SCALAR", 1);
  const auto sampler = [](int output) {
    return R"({"input":1,"interpolation":"STEP","output":)" + std::to_string(output) + "}";
  };
  return w.glb(R"("scenes":[{"nodes":[0]}],
    "nodes":[{"name":"top","children":[1,2]},{"name":"low","mesh":0},{"name":"eye","camera":0}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.8}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":0}]}]}],
    "animations":[{"samplers":[)" +
               sampler(2) + "," + sampler(3) + "," + sampler(4) + R"(],"channels":[
      {"sampler":0,"target":{"node":0,"path":"translation"}},
      {"sampler":1,"target":{"node":1,"path":"scale"}},
      {"sampler":2,"target":{"node":1,"path":"weights"}}]}])");
}

TEST(GltfTime, EveryFrameShowsItsOwnStep) {
  for (const auto& [fps, time_of] : {std::pair{24.0, kRounded},
                                     {25.0, kRounded},
                                     {30.0, kRounded},
                                     {29.97, kRounded},
                                     {60.0, kRounded},
                                     {24.0, kMultiplied},
                                     {30.0, kMultiplied},
                                     {23.976, kRational}}) {
    const auto document =
        gltf::read_document(test::write_test_file("stepped.glb", stepped_glb(fps, time_of)));
    ASSERT_TRUE(document) << document.error().message;
    const auto motion = gltf::NodeMotion::read(*document);
    ASSERT_TRUE(motion) << motion.error().message;
    const FileClock clock{static_cast<float>(fps), 0};
    int wrong = 0;
    for (int n = 0; n < kFrames; ++n) {
      const double seconds = clock.seconds_at(n);
      const std::vector<gltf::Matrix> world = motion->to_world(seconds);
      wrong += world[0][3] != n || world[1][0] != n % 2 || motion->weights(1, seconds)[0] != n;
    }
    EXPECT_EQ(wrong, 0) << fps << " frames a second";
  }
}

TEST(GltfTime, CamerasCutAndShapesSwitchOnTheirFrame) {
  const JobSpec job = test::settled(
      test::job_of(test::write_test_file("stepped.glb", stepped_glb(24, kRounded)), ""));
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene) << scene.error().message;
  for (const CameraKey& key : job.camera.keys)
    EXPECT_EQ(key.position.x, std::min(key.frame, kFrames - 1.0));
  for (const double frame : {1.0, 3.0}) {
    const Pose pose = pose_at(*scene, job, frame);
    const Instance& low = pose.instances.at(0);
    EXPECT_FALSE(low.is_absent);
    EXPECT_EQ(low.to_world.offset.x, frame);
    EXPECT_EQ(vertices_of(*scene, pose.shapes, low.mesh).positions[1].x, 1 + frame);
  }
  EXPECT_TRUE(pose_at(*scene, job, 2).instances.at(0).is_absent);
}

/// What frame 5 of a job shows, and the frames beside it: camera, places, first vertices.
std::vector<Vec3> around_frame_5(const JobSpec& job) {
  const auto scene = load_scene(job);
  EXPECT_TRUE(scene) << scene.error().message;
  std::vector<Vec3> shown;
  for (int frame = 4; scene && frame <= 6; ++frame) {
    const Pose pose = pose_at(*scene, job, frame);
    shown.push_back(camera_at(job, frame).position);
    for (const Instance& instance : pose.instances) {
      shown.push_back(instance.to_world.offset);
      shown.push_back({instance.is_absent ? 0.0f : 1.0f, 0, 0});
      shown.push_back(vertices_of(*scene, pose.shapes, instance.mesh).positions[1]);
    }
  }
  return shown;
}

TEST(GltfTime, WhatAFrameShowsDependsOnItsNumberAlone) {
  // At half the rate node "low" is there in every fourth frame: in 6, not in 4 and 5.
  const std::string path = test::write_test_file("stepped.glb", stepped_glb(24, kRounded));
  const auto job_of = [&](const char* frames) {
    JobSpec job = test::job_of(path, R"(, "fps": 48})");
    job.scene.objects = {ObjectSpec{.mesh = "m", .material = "d"}};
    job.scene.meshes["m"] = {.path = path, .mesh = 0};
    job.scene.materials["d"] = {};
    job.scene.objects[0].gltf = GltfMotion{.file = path, .node = "top", .fps = 48};
    job.frames = parse_frames(frames).value();
    const JobSpec settled = test::settled(job);
    const auto again = parse_job(to_json(settled), "again", "/");
    EXPECT_TRUE(again) << again.error().message;
    return settled;
  };
  const JobSpec first = job_of("1-12");
  const std::vector<Vec3> shown = around_frame_5(first);
  EXPECT_EQ(shown.at(0), (Vec3{2, 0, 0})) << "frame 4";
  for (const auto& [frames, same_step] : {std::pair{"5", true},
                                          {"5-12", true},
                                          {"1-600", true},
                                          {"1-9x2", false},
                                          {"1,5", false},
                                          {"0,5,9999999", false}}) {
    const JobSpec job = job_of(frames);
    EXPECT_EQ(around_frame_5(job), shown) << frames;
    EXPECT_EQ(job.camera.position, first.camera.position) << frames;
    // How far samples are followed is measured over the whole animation.
    if (!same_step) continue;
    EXPECT_EQ(job.motion.max_px, first.motion.max_px) << frames;
  }
}

TEST(GltfTime, AnimationsTooLongForKeysAreTakenAroundTheFrames) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 1 << 20}, "SCALAR", 1);
  w.add(std::vector<float>{0, 0, 0, 1 << 20, 0, 0}, "VEC3", 3);
  const std::string path = test::write_test_file(
      "long.glb", w.glb(R"("nodes":[{"name":"a","mesh":0,"children":[1]},{"name":"eye","camera":0}],
               "cameras":[{"type":"perspective","perspective":{"yfov":0.8}}],)" +
                        test::mesh_json("\"POSITION\":0") +
                        R"(,"animations":[{"samplers":[{"input":1,"output":2}],
                "channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}])"));
  JobSpec job = test::job_of(path, R"(, "fps": 1})");
  job.frames = parse_frames("2-9999x1000").value();
  job = test::settled(job);
  EXPECT_EQ(job.camera.keys.size(), 3 * job.frames.size());
  for (const int frame : {1, 2, 3, 1001, 1002, 1003}) {
    EXPECT_EQ(camera_at(job, frame).position.x, frame);
    EXPECT_EQ(object_motion_at(job.scene.objects.at(0), job.motion.curve, frame).offset.x, frame);
  }
}

/// Two curves whose last two keys are at one time.
std::string repeating_glb(const std::string& curve, const std::vector<float>& values) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 1, 1}, "SCALAR", 1);
  w.add(values, "VEC3", 3);
  return w.glb(R"("nodes":[{"name":"a","mesh":0}],)" + test::mesh_json("\"POSITION\":0") +
               R"(,"animations":[{"samplers":[{"input":1,"output":2,"interpolation":")" + curve +
               R"("}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}])");
}

TEST(GltfTime, OfKeysAtOneTimeTheLastCounts) {
  const std::vector<float> plain{0, 0, 0, 5, 0, 0, 7, 0, 0};
  std::vector<float> cubic(27);
  cubic[12] = 5;
  cubic[21] = 7;
  for (const auto& [curve, values] :
       {std::pair{"STEP", plain}, {"LINEAR", plain}, {"CUBICSPLINE", cubic}}) {
    std::vector<std::string> said;
    const auto settled = settle_motion(
        test::job_of(test::write_test_file("repeats.glb", repeating_glb(curve, values)),
                     R"(, "fps": 1, "startFrame": 1})",
                     R"(, "camera": {"position": [0, 0, 4], "lookAt": [0, 0, 0]})"),
        &said);
    ASSERT_TRUE(settled) << settled.error().message;
    EXPECT_EQ(object_motion_at(settled->scene.objects[0], KeyCurve::linear, 2).offset.x, 7)
        << curve;
    EXPECT_THAT(said,
                testing::Contains(testing::HasSubstr("1 keys of its animations are at the time of "
                                                     "another")))
        << curve;
  }
}

/// A node that turns by keys of one second each, and where it is.
Result<gltf::NodeMotion> motion_of(const std::string& name, const std::string& path,
                                   const std::string& curve, const std::vector<float>& times,
                                   const std::vector<float>& values) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(times, "SCALAR", 1);
  path == "rotation" ? w.add(values, "VEC4", 4) : w.add(values, "VEC3", 3);
  const auto document = gltf::read_document(test::write_test_file(
      name,
      w.glb(R"("nodes":[{"name":"a","mesh":0}],)" + test::mesh_json("\"POSITION\":0") +
            R"(,"animations":[{"samplers":[{"input":1,"output":2,"interpolation":")" + curve +
            R"("}],"channels":[{"sampler":0,"target":{"node":0,"path":")" + path + R"("}}]}])")));
  if (!document) return document.error();
  return gltf::NodeMotion::read(*document);
}

// Up to the jump a curve leads to the first of the keys there, behind it from the last.
TEST(GltfTime, KeysAtOneTimeAreAJump) {
  const std::vector<float> times{0, 2, 2, 2, 4}, x{-0.5f, 0, 9, 0.25f, 1.25f};
  std::vector<float> values, cubic;
  for (const float v : x) {
    values.insert(values.end(), {v, 0, 0});
    cubic.insert(cubic.end(), {0, 0, 0, v, 0, 0, 0, 0, 0});
  }
  for (const auto& [curve, numbers, before] : {std::tuple{"LINEAR", values, -0.25f},
                                               {"STEP", values, -0.5f},
                                               {"CUBICSPLINE", cubic, -0.25f}}) {
    const auto motion = motion_of("jump.glb", "translation", curve, times, numbers);
    ASSERT_TRUE(motion) << motion.error().message;
    const auto at = [&](double seconds) { return motion->to_world(seconds)[0][3]; };
    EXPECT_NEAR(at(1), before, 1e-6) << curve;
    EXPECT_NEAR(at(1.999), curve == std::string("STEP") ? -0.5 : 0, 1e-3) << curve;
    EXPECT_NEAR(at(2), 0.25, 1e-6) << curve;
    EXPECT_NEAR(at(3), curve == std::string("STEP") ? 0.25 : 0.75, 1e-6) << curve;
    EXPECT_NEAR(at(9), 1.25, 1e-6) << curve;
    EXPECT_THAT(motion->notes(), testing::Contains(testing::HasSubstr("2 keys of its")));
  }
  // At both ends.
  const auto ends = motion_of("ends.glb", "translation", "LINEAR", {1, 1, 3, 3},
                              {0, 0, 0, 4, 0, 0, 6, 0, 0, 8, 0, 0});
  ASSERT_TRUE(ends) << ends.error().message;
  for (const auto& [seconds, x_there] : {std::pair{0.0, 0.0}, {1.0, 4.0}, {2.0, 5.0}, {3.0, 8.0}})
    EXPECT_NEAR(ends->to_world(seconds)[0][3], x_there, 1e-6) << seconds;
}

TEST(GltfTime, ARotationOfZerosIsNoKey) {
  const float h = std::sqrt(0.5f);
  const std::vector<float> turned{0, 0, 0, 1, 0, 0, 0, 0, 0, 0, h, h};
  std::vector<float> cubic;
  for (std::size_t k = 0; k < 3; ++k) {
    cubic.insert(cubic.end(), 4, 0.0f);
    cubic.insert(cubic.end(), turned.begin() + static_cast<long>(4 * k),
                 turned.begin() + static_cast<long>(4 * k + 4));
    cubic.insert(cubic.end(), 4, 0.0f);
  }
  for (const auto& [curve, numbers] : {std::pair{"LINEAR", turned}, {"CUBICSPLINE", cubic}}) {
    const auto motion = motion_of("zeros.glb", "rotation", curve, {0, 2, 4}, numbers);
    ASSERT_TRUE(motion) << motion.error().message;
    const auto world = motion->to_world(2);
    EXPECT_NEAR(std::atan2(world[0][4], world[0][0]) * 180 / 3.14159265, 45, 0.01) << curve;
    EXPECT_THAT(motion->notes(),
                testing::Contains(testing::HasSubstr("1 keys of its animations have "
                                                     "a time or value that is")));
  }
}

/// Three animations: "slide" moves node "a" along x, "lift" along y and grows "b", one without a
/// name turns "b".
std::string several_glb() {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 1}, "SCALAR", 1);
  w.add(std::vector<float>{0, 0, 0, 4, 0, 0}, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 0, 0, 6, 0}, "VEC3", 3);
  w.add(std::vector<float>{1, 1, 1, 3, 3, 3}, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 0}, "VEC4", 4);
  w.add(std::vector<float>{0, 1}, "SCALAR", 1);
  const auto animation = [](const std::string& name, const std::string& samplers,
                            const std::string& channels) {
    return "{" + name + "\"samplers\":[" + samplers + "],\"channels\":[" + channels + "]}";
  };
  const auto channel = [](int sampler, int node, const std::string& path) {
    return fmt::format(R"({{"sampler":{},"target":{{"node":{},"path":"{}"}}}})", sampler, node,
                       path);
  };
  return w.glb(R"("nodes":[{"name":"a","mesh":0},{"name":"b","mesh":0}],)" +
               test::mesh_json("\"POSITION\":0", R"(,"targets":[{"POSITION":0}])") +
               R"(,"animations":[)" +
               animation(R"("name":"slide",)", R"({"input":1,"output":2},{"input":1,"output":6})",
                         channel(0, 0, "translation")) +
               "," +
               animation(R"("name":"lift",)", R"({"input":1,"output":3},{"input":1,"output":4})",
                         channel(0, 0, "translation") + "," + channel(1, 1, "scale")) +
               "," +
               animation("", R"({"input":1,"output":5},{"input":1,"output":6})",
                         channel(0, 1, "rotation") + "," + channel(1, 1, "weights")) +
               "]");
}

TEST(GltfTime, AJobChoosesAmongAnimations) {
  const std::string path = test::write_test_file("several.glb", several_glb());
  struct Case {
    std::string choice;
    float x, y, size, turned;
    bool deforms;
  };
  for (const Case& c : {Case{"", 4, 0, 3, -1, true},
                        {"slide", 4, 0, 1, 1, false},
                        {"lift", 0, 6, 3, 1, false},
                        {"1", 0, 6, 3, 1, false},
                        {"2", 0, 0, 1, -1, true},
                        {"animation 2", 0, 0, 1, -1, true}}) {
    const std::string choice = c.choice.empty() ? "" : R"(, "animation": ")" + c.choice + "\"";
    const JobSpec written =
        test::job_of(path, R"(, "fps": 1)" + choice + "}",
                     R"(, "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]})");
    std::vector<std::string> said;
    const auto settled = settle_motion(written, &said);
    ASSERT_TRUE(settled) << settled.error().message;
    const auto place = [&](std::size_t object) {
      const ObjectSpec& o = settled->scene.objects.at(object);
      return o.keys.empty() ? to_transform(*o.matrix) : object_motion_at(o, KeyCurve::linear, 1);
    };
    EXPECT_EQ(place(0).offset.x, c.x) << c.choice;
    EXPECT_EQ(place(0).offset.y, c.y) << c.choice;
    EXPECT_NEAR(place(1).linear.m[0], c.size * c.turned, 1e-6f) << c.choice;
    const auto scene = load_scene(*settled);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(std::ranges::any_of(scene->instances, &Instance::deforms), c.deforms) << c.choice;
    // The settled document keeps the choice of meshes that deform.
    const auto again = parse_job(to_json(*settled), "again", "/");
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->scene, settled->scene);
    // Where nothing is chosen and two move the same, it is said.
    const auto uses = animations_of(written);
    ASSERT_EQ(uses.size(), 1u);
    if (c.choice.empty()) {
      EXPECT_THAT(said,
                  testing::Contains(testing::HasSubstr(
                      "1 curves of its animations move what an earlier one moves, and are left "
                      "out: `animation` chooses one of \"slide\", \"lift\", \"animation 2\"")));
      EXPECT_EQ(text_of(uses[0]), path + ": \"slide\", \"lift\", \"animation 2\" play");
    } else {
      EXPECT_THAT(said, testing::IsEmpty());
      EXPECT_THAT(text_of(uses[0]), testing::HasSubstr(" plays, of \"slide\", "));
    }
  }
  EXPECT_THAT(test::error_of(test::job_of(path, R"(, "animation": "lft"})")),
              testing::HasSubstr("several.glb: no animation \"lft\"; did you mean \"lift\"?"));
}

TEST(GltfTime, CamerasObjectsAndShapesChooseTheirAnimation) {
  const std::string path = test::write_test_file("several.glb", several_glb());
  const GltfMotion motion{.file = path, .node = "a", .fps = 1, .animation = "lift"};
  JobSpec job;
  job.frames = {FrameNumber(1)};
  job.scene.materials["d"] = {};
  job.scene.meshes["m"] = {.path = path, .mesh = 0};
  job.scene.meshes["shaped"] = {
      .path = path,
      .mesh = 0,
      .shaped_by = ShapeSpec{.node = 1, .animation = FileClock{.fps = 1, .animation = "slide"}}};
  job.scene.objects = {{.mesh = "m", .material = "d"}, {.mesh = "shaped", .material = "d"}};
  job.scene.objects[0].gltf = motion;
  const auto settled = settle_motion(job);
  ASSERT_TRUE(settled) << settled.error().message;
  EXPECT_EQ(object_motion_at(settled->scene.objects[0], KeyCurve::linear, 1).offset.y, 6);
  const auto scene = load_scene(*settled);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto first_vertex = [&](const Scene& s, const JobSpec& j) {
    return vertices_of(s, pose_at(s, j, 1).shapes, s.instances.at(1).mesh).positions[1];
  };
  EXPECT_EQ(first_vertex(*scene, *settled), (Vec3{1, 0, 0})) << "slide does not morph";
  job.scene.meshes["shaped"].shaped_by->animation->animation = "2";
  const auto other = load_scene(job);
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(first_vertex(*other, job), (Vec3{2, 0, 0}));
  EXPECT_EQ(animations_of(job).size(), 2u);
  job.scene.objects[0].gltf->node = "b";
  job.scene.objects[0].gltf->animation = "slide";
  EXPECT_THAT(test::error_of(job),
              testing::HasSubstr("node \"b\": nothing of animation \"slide\" moves it"));
}

}  // namespace
}  // namespace baton
