#include "common/job/plan/sequence.h"

#include <gtest/gtest.h>

#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

JobSpec turning(std::string_view frames) {
  JobSpec job;
  job.frames = parse_frames(frames).value();
  job.environment.keys = {{1, "a.exr"}, {20, "b.exr"}};
  job.environment.interpolate = true;
  job.environment.rotation_start_deg = 10;
  job.environment.rotation_deg_per_frame = 15;
  return job;
}

TEST(Sequence, LightsAFrameAlikeInEveryJobThatHasIt) {
  const EnvironmentFrame of_all = expand_sequence(turning("1-24"))[11].environment;
  EXPECT_EQ(of_all, expand_sequence(turning("12"))[0].environment);
  EXPECT_EQ(of_all, expand_sequence(turning("3,12,20"))[1].environment);
  EXPECT_EQ(of_all.rotation, rotation_about({0, 1, 0}, 10 + 11 * 15));
}

TEST(Sequence, TurnsFromTheFrameThatIsSaid) {
  JobSpec job = turning("1001,1003");
  job.environment.rotation_start_frame = 1001;
  const std::vector<FrameSpec> frames = expand_sequence(job);
  EXPECT_EQ(frames[0].environment.rotation, rotation_about({0, 1, 0}, 10));
  EXPECT_EQ(frames[1].environment.rotation, rotation_about({0, 1, 0}, 40));
}

// Blender has both: a world that turns and glows as its keys say.
TEST(Environment, ScaleAndRotationFollowKeys) {
  const auto job = parse_job(
      R"({"name": "t", "scene": {}, "frames": "1-9", "environment": {"map": "a.exr", "scale": 2,
          "scaleKeys": [{"frame": 2, "scale": 1}, {"frame": 6, "scale": 3}, {"frame": 8, "scale": 0}],
          "rotation": {"keys": [{"frame": 1, "deg": 10}, {"frame": 5, "deg": 50}]}}})",
      "job", "/");
  ASSERT_TRUE(job) << job.error().message;
  const EnvironmentSpec& environment = job->environment;
  const auto at = [&](int frame) { return environment_at(environment, FrameNumber(frame)); };
  EXPECT_EQ(at(1).scale, 1) << "held";
  EXPECT_EQ(at(3).scale, 1.5f);
  EXPECT_EQ(at(6).scale, 3);
  EXPECT_EQ(at(9).scale, 0) << "no light";
  EXPECT_EQ(rotation_deg_at(environment, FrameNumber(2)), 20);
  EXPECT_EQ(rotation_deg_at(environment, FrameNumber(8)), 50);
  EXPECT_FALSE(at(3).same_texels(at(4)));
  EXPECT_EQ(parse_job(to_json(*job), "again", "/").value(), *job);

  const auto wrong = parse_job(
      R"({"name": "t", "scene": {}, "environment": {"map": "a.exr",
          "scaleKeys": [{"frame": 2, "scale": 1}, {"frame": 2, "scale": -1}],
          "rotation": {"startDeg": 5, "keys": [{"frame": 1, "deg": 10}]}}})",
      "job", "/");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(
      wrong.error().message,
      "job: $.environment.scaleKeys[1].scale: expected a number in [0, 1000000000], got -1\n"
      "job: $.environment.scaleKeys: expected ascending frames without duplicates, got 2 after 2\n"
      "job: $.environment.rotation.keys: expected either keys or startDeg and degPerFrame, got "
      "both");
}

TEST(ImageSpec, IsReadWithARegionAndScaled) {
  const auto image_of = [](const std::string& image) {
    return parse_job(
        R"({"name": "t", "scene": {}, "environment": {"map": "a.exr"}, "image": )" + image + "}",
        "job", "/");
  };
  const Result<JobSpec> job =
      image_of(R"({"width": 200, "height": 100, "region": [20, 40, 100, 60], "scale": 0.5})");
  ASSERT_TRUE(job) << job.error().message;
  const ImageSpec expected{.width = 100, .height = 50, .region = PixelRect{10, 20, 60, 50}};
  EXPECT_EQ(job->image, expected);
  EXPECT_EQ(parse_job(to_json(*job), "again", "/").value(), *job);
  EXPECT_EQ(to_json(image_of("{}").value()).find("region"), std::string::npos);
}

TEST(Catchers, AreGroundObjectsAndNodes) {
  const auto job_of = [](const std::string& scene, const std::string& more = "") {
    return parse_job(
        R"({"name": "t", "environment": {"map": "a.exr"}, "scene": {)" + scene + "}" + more + "}",
        "job", "/");
  };
  const std::string things = R"("materials": {"m": {"type": "diffuse"}}, "meshes": {"a": "a.ply"})";
  const std::string objects = things + R"(, "objects": [{"mesh": "a", "material": "m"},
                                            {"mesh": "a", "material": "m", "catcher": )";
  const JobSpec plain = job_of(objects + "false}]").value(),
                job = job_of(objects + "true}]").value();
  EXPECT_FALSE(has_catcher(plain));
  EXPECT_EQ(to_json(plain).find("catcher"), std::string::npos)
      << "as without the key: the digest of a picture stays";
  EXPECT_EQ(catcher_key(job), "scene.objects[1].catcher");
  EXPECT_EQ(parse_job(to_json(job), "again", "/").value(), job);
  EXPECT_EQ(
      catcher_key(job_of(things + R"(, "ground": {"material": "m", "catcher": true})").value()),
      "scene.ground.catcher");
  EXPECT_EQ(
      catcher_key(
          job_of(R"("gltf": {"file": "a.glb", "nodes": {"stairs": {"catcher": true}}})").value()),
      "scene.gltf.nodes.stairs.catcher");
  EXPECT_EQ(
      job_of(objects + "true}]", R"(, "sampling": {"method": "bidirectional"},
                                       "visibility": {"correlated": true})")
          .error()
          .message,
      "job: $.visibility: expected correlated false, as scene.objects[1].catcher is true, whose "
      "shadows no second pass exchanges, got true");
}

TEST(ImageSpec, IsReadWithOverscan) {
  const auto image_of = [](const std::string& image) {
    return parse_job(
        R"({"name": "t", "scene": {}, "environment": {"map": "a.exr"}, "image": )" + image + "}",
        "job", "/");
  };
  const Result<JobSpec> one = image_of(R"({"overscan": 8})");
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->image.overscan, (Overscan{8, 8, 8, 8}));
  EXPECT_EQ(one->image.shown(), (PixelRect{0, 0, 640, 360}));
  EXPECT_EQ(one->image.rendered(), (PixelRect{-8, -8, 648, 368}));
  const Result<JobSpec> job =
      image_of(R"({"region": [20, 40, 100, 60], "overscan": [1, 2, 3, 4]})");
  ASSERT_TRUE(job) << job.error().message;
  EXPECT_EQ(job->image.rendered(), (PixelRect{19, 38, 123, 104}));
  EXPECT_EQ(parse_job(to_json(*job), "again", "/").value(), *job);
  EXPECT_EQ(to_json(image_of(R"({"overscan": 0})").value()).find("overscan"), std::string::npos)
      << "as without the key: the digest of a picture stays";
  EXPECT_EQ(image_of(R"({"overscan": [1, 2]})").error().message,
            "job: $.image.overscan: expected a number or a list of 4 numbers, got a list of 2");
  EXPECT_EQ(image_of(R"({"overscan": -1})").error().message,
            "job: $.image.overscan: expected a number in [0, 4096], got -1");
  EXPECT_EQ(image_of(R"({"overscan": [1, 2, 0.5, 4]})").error().message,
            "job: $.image.overscan: expected whole pixels, and with them at most 32768 a side, got "
            "[1, 2, 0.5, 4]");
  EXPECT_EQ(image_of(R"({"width": 32768, "height": 1, "overscan": 1})").error().message,
            "job: $.image.overscan: expected whole pixels, and with them at most 32768 a side, got "
            "[1, 1, 1, 1]");
}

}  // namespace
}  // namespace baton
