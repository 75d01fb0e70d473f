#include "common/job/sequence.h"

#include <gtest/gtest.h>

#include "common/job/job_json.h"

namespace baton {
namespace {

JobSpec turning(std::vector<int> frames) {
  JobSpec job;
  job.frames = std::move(frames);
  job.environment.keys = {{1, "a.exr"}, {20, "b.exr"}};
  job.environment.interpolate = true;
  job.environment.rotation_start_deg = 10;
  job.environment.rotation_deg_per_frame = 15;
  return job;
}

TEST(Sequence, LightsAFrameAlikeInEveryJobThatHasIt) {
  std::vector<int> all;
  for (int frame = 1; frame <= 24; ++frame) all.push_back(frame);
  const EnvironmentFrame of_all = expand_sequence(turning(all))[11].environment;
  EXPECT_EQ(of_all, expand_sequence(turning({12}))[0].environment);
  EXPECT_EQ(of_all, expand_sequence(turning({3, 12, 20}))[1].environment);
  EXPECT_EQ(of_all.rotation, rotation_about({0, 1, 0}, 10 + 11 * 15));
}

TEST(Sequence, TurnsFromTheFrameThatIsSaid) {
  JobSpec job = turning({1001, 1003});
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
  EXPECT_EQ(environment_at(environment, 1).scale, 1) << "held";
  EXPECT_EQ(environment_at(environment, 3).scale, 1.5f);
  EXPECT_EQ(environment_at(environment, 6).scale, 3);
  EXPECT_EQ(environment_at(environment, 9).scale, 0) << "no light";
  EXPECT_EQ(rotation_deg_at(environment, 2), 20);
  EXPECT_EQ(rotation_deg_at(environment, 8), 50);
  EXPECT_FALSE(environment_at(environment, 3).same_texels(environment_at(environment, 4)));
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

// Runs of a job that was shorter stay as they were.
TEST(Runs, LeadingOnesComeBeforeTheRegularOnes) {
  JobSpec job;
  job.frames.clear();
  for (int frame = 1; frame <= 30; ++frame) job.frames.push_back(frame);
  job.state.checkpoint_every = 12;
  EXPECT_EQ(run_starts(job), (std::vector<std::int32_t>{0, 12, 24}));
  job.leading_runs = {0, 5, 8};
  EXPECT_EQ(run_starts(job), (std::vector<std::int32_t>{0, 5, 8, 12, 24}));
  EXPECT_EQ(num_runs(job), 5);
  EXPECT_EQ(tile_run(job, 0, 2).last_frame, 11);
  job.frames.resize(7);
  EXPECT_EQ(run_starts(job), (std::vector<std::int32_t>{0, 5}));
  EXPECT_EQ(tile_run(job, 0, 1).last_frame, 6);
}

// Runs end with their sweep; the frames before stay as they were when there are more sweeps.
TEST(Runs, EachSweepHasTheSame) {
  JobSpec job;
  job.frames = {3, 4, 5, 6, 8};
  job.state.checkpoint_every = 2;
  job.quality = {.rounds = 4, .sweeps = 3};
  EXPECT_EQ(num_steps(job), 15);
  EXPECT_EQ(run_starts(job), (std::vector<std::int32_t>{0, 2, 4, 5, 7, 9, 10, 12, 14}));
  EXPECT_EQ(num_runs(job), 9);
  EXPECT_EQ(tile_run(job, 0, 2).last_frame, 4);
  job.leading_runs = {0, 1};
  EXPECT_EQ(run_starts(job), (std::vector<std::int32_t>{0, 1, 2, 4, 5, 7, 9, 10, 12, 14}));

  const std::vector<FrameSpec> steps = expand_sequence(job);
  EXPECT_EQ(steps[8].index, 8);
  EXPECT_EQ(steps[8].number, 6);
  EXPECT_EQ(steps[8].first_round, 4);
  EXPECT_EQ(frame_of_step(job, 8), 3);
}

}  // namespace
}  // namespace baton
