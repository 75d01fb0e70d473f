#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSceneText =
    R"({"materials": {"my gold": {"type": "diffuse"}}, "meshes": {"m": "m.obj"},
        "objects": [{"mesh": "m", "material": "my gold"}], "ground": {"material": "my gold"}})";

/// job.json, whose scene is in a file of its own.
fs::path job_file() {
  const fs::path folder =
      fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::create_directories(folder / "parts");
  EXPECT_TRUE(write_file_atomic(folder / "parts/scene.json", as_bytes_view(kSceneText)).ok());
  constexpr std::string_view kJobText =
      R"({"name": "t", "scene": "parts/scene.json", "frames": "1-48",
          "image": {"width": 640, "height": 360}, "environment": {"map": "a.exr"}})";
  EXPECT_TRUE(write_file_atomic(folder / "job.json", as_bytes_view(kJobText)).ok());
  return folder / "job.json";
}

JobSpec with(const std::vector<JobOverride>& overrides) {
  Result<JobSpec> job = load_job(job_file(), overrides);
  EXPECT_TRUE(job.ok()) << (job.ok() ? "" : job.error().message);
  return job.ok() ? std::move(job).value() : JobSpec{};
}

std::string faults_with(const std::vector<JobOverride>& overrides) {
  const Result<JobSpec> job = load_job(job_file(), overrides);
  return job.ok() ? "none" : job.error().message;
}

TEST(JobOverrides, ReplaceValuesAndMakeObjects) {
  JobSpec expected = with({});
  expected.frames = {FrameNumber(12)};
  expected.image.width = 64;
  expected.image.sites = 4;
  expected.sampling.brdf_fraction = 0.5f;
  expected.environment.scale = 0.1f;
  expected.output.pattern = ".##.exr";
  expected.sampling.num_particles = 8;
  expected.environment.keys[0].map = job_file().parent_path() / "b.exr";
  EXPECT_EQ(with({{"frames", "\"12\"", "--frames"},
                  {"image.width", "32"},
                  {"$.image.width", "64"},
                  {"image.sites", "4"},
                  {"sampling.brdfFraction", ".5"},
                  {"environment.scale", "1e-1"},
                  {"output.pattern", ".##.exr"},
                  {"sampling.numParticles", "8"},
                  {"environment.map", "b.exr"}}),
            expected);
}

TEST(JobOverrides, ReachIntoListsOddNamesAndOtherFiles) {
  const JobSpec job = with({{"scene.objects[0].fitHeight", "2"},
                            {"$.scene.materials[\"my gold\"].color", "[1, 0.5, 0]"},
                            {"scene.ground.size", "7"}});
  EXPECT_EQ(job.scene.objects.at(0).fit_height, 2.0f);
  EXPECT_EQ(job.scene.materials.at("my gold").base_color, (Rgb{1, 0.5f, 0}));
  EXPECT_EQ(job.scene.ground->size, 7);
  EXPECT_EQ(job.scene.meshes.at("m").path, job_file().parent_path() / "parts/m.obj");
}

TEST(JobOverrides, FaultsNameTheOptionAndSuggest) {
  EXPECT_EQ(faults_with({{"sampling.numParticels", "8"}}),
            "--set: $.sampling.numParticels: unknown key; did you mean \"numParticles\"?");
  EXPECT_EQ(faults_with({{"samplng.numParticles", "8"}}),
            "--set: $.samplng: unknown key; did you mean \"sampling\"?");
  EXPECT_EQ(faults_with({{"image.scale", "3", "--scale"}}),
            "--scale: $.image.scale: expected a number in (0, 1], got 3");
  EXPECT_EQ(faults_with({{"scene.ground.sise", "3"}}),
            "--set: $.scene.ground.sise: unknown key; did you mean \"size\"?");
  EXPECT_EQ(faults_with({{"image.sites", "4"}, {"image.region", "[0, 0, 641, 1]", "--region"}}),
            "--region: $.image.region: expected x, y, width and height in whole pixels, inside of "
            "640 x 360, got [0, 0, 641, 1]");
}

TEST(JobOverrides, WhatTheyMakeIsTheirs) {
  EXPECT_EQ(faults_with({{"sampling.timeBudget", "3"}}),
            "--set: $.sampling.method: expected \"auto\" with targetError or timeBudget, got "
            "\"pool\"");
  EXPECT_THAT(faults_with({{"image.width", "8"}, {"scene.meshes", "{}"}}),
              testing::AllOf(testing::HasSubstr("parts/scene.json: $.objects[0].mesh: "),
                             testing::Not(testing::HasSubstr("--set"))));
}

TEST(JobOverrides, SayWhereNothingCanBeSet) {
  const std::string expected =
      ": expected a key of an object or the index of an element of a list that the job has";
  EXPECT_EQ(faults_with({{"scene.objects[1].fitHeight", "2"}}),
            "--set: $.scene.objects[1].fitHeight" + expected);
  EXPECT_EQ(faults_with({{"image.width.x", "2"}}), "--set: $.image.width.x" + expected);
  for (const char* const path : {"", "$", "a..b", "a.", "a[", "a[x]", "a[-1]", "a[]b", "a[0]b"})
    EXPECT_THAT(faults_with({{path, "2"}}), testing::HasSubstr("expected the path of a value"))
        << path;
}

}  // namespace
}  // namespace baton
