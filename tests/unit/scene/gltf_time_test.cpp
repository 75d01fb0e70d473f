// Which key of a glTF file a frame shows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/gltf/node_motion.h"
#include "common/scene/pose.h"
#include "common/scene/scene_warnings.h"
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
  for (const CameraKey& key : job.camera.keys) EXPECT_EQ(key.position.x, key.frame);
  for (const double frame : {1.0, 3.0}) {
    const Pose pose = pose_at(*scene, job, frame);
    const Instance& low = pose.instances.at(0);
    EXPECT_FALSE(low.is_absent);
    EXPECT_EQ(low.to_world.offset.x, frame);
    EXPECT_EQ(vertices_of(*scene, pose.shapes, low.mesh).positions[1].x, 1 + frame);
  }
  EXPECT_TRUE(pose_at(*scene, job, 2).instances.at(0).is_absent);
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
    const JobSpec job = test::settled(
        test::job_of(test::write_test_file("repeats.glb", repeating_glb(curve, values)),
                     R"(, "fps": 1, "startFrame": 1})",
                     R"(, "camera": {"position": [0, 0, 4], "lookAt": [0, 0, 0]})"));
    EXPECT_EQ((*job.scene.objects[0].keys[1].matrix)[3], 7) << curve;
    EXPECT_THAT(scene_warnings(job.scene),
                testing::Contains(testing::HasSubstr("1 keys of its animations are at the time of "
                                                     "another")))
        << curve;
  }
}

}  // namespace
}  // namespace baton
