#include "jobs/study/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/job/text/frame_range.h"
#include "jobs/study/run_record.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// A folder with one small job file.
class StudyTest : public testing::Test {
 protected:
  StudyTest() {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "job.json") << R"({
      "name": "job", "frames": "1-8", "image": {"width": 32, "height": 16},
      "scene": {"materials": {"m": {"type": "diffuse"}}, "ground": {"material": "m"}},
      "environment": {"map": "sky.hdr"}, "sampling": {"numParticles": 8, "numCandidates": 64}})";
  }
  ~StudyTest() override { fs::remove_all(folder_); }

  Result<Study> parse(const std::string& text) const {
    return parse_study(text, "study.json", folder_);
  }
  /// The error of a study that must have one.
  std::string fault(const std::string& text) const {
    const Result<Study> study = parse(text);
    return study ? "no error" : study.error().message;
  }

  fs::path folder_ = fs::temp_directory_path() / ("baton-study-" + std::to_string(::getpid()));
};

const char* const kStudy = R"({
  "name": "s", "seeds": 3, "patch": {"frames": "1-4", "seed": 9}, "measureFrames": "3-4",
  "referenceSamples": 64,
  "scenes": [{"name": "a", "job": "job.json"},
             {"name": "b", "job": "job.json", "crop": [1, 2, 3, 4],
              "patch": {"environment": {"rotation": {"degPerFrame": 2}}}}],
  "methods": [{"name": "m", "patch": {"sampling": {"method": "mis"}}},
              {"name": "q", "patch": {"sampling": {"method": "sequential"}},
               "budgets": [{"name": "more", "patch": {"sampling": {"numCandidates": 256}}}]}],
  "budgets": [4, 16]})";

TEST_F(StudyTest, EveryCombinationIsAJob) {
  const Result<Study> study = parse(kStudy);
  ASSERT_TRUE(study) << study.error().message;
  EXPECT_EQ(study->num_seeds, 3);
  ASSERT_EQ(study->scenes.size(), 2u);
  ASSERT_EQ(study->cells.size(), 6u);

  // Patches apply in the order study, scene, method, budget.
  const StudyCell& small = study->cells[0];
  EXPECT_EQ(small.budget, "4");
  EXPECT_EQ(small.job.sampling.method, Method::mis);
  EXPECT_EQ(small.job.sampling.num_particles, 4);
  EXPECT_EQ(small.job.sampling.num_candidates, 64);
  EXPECT_EQ(format_frames(small.job.frames), "1-4");
  const StudyCell& more = study->cells[5];
  EXPECT_EQ(more.scene, 1u);
  EXPECT_EQ(more.budget, "more");
  EXPECT_EQ(more.job.sampling.num_candidates, 256);
  EXPECT_EQ(more.job.environment.rotation_deg_per_frame, 2);
  EXPECT_EQ(more.job.name, "b q more");
}

TEST_F(StudyTest, ReferencesAreTwoHalvesOfTheMeasuredFrames) {
  const Result<Study> study = parse(kStudy);
  ASSERT_TRUE(study) << study.error().message;
  const StudyScene& scene = study->scenes[1];
  EXPECT_EQ(format_frames(scene.frames), "3-4");
  EXPECT_THAT(scene.crop, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(scene.reference[0].sampling.method, Method::reference);
  EXPECT_EQ(scene.reference[0].sampling.reference_samples, 64);
  EXPECT_EQ(scene.reference[0].environment.rotation_deg_per_frame, 2);
  EXPECT_EQ(scene.reference[0].frames, scene.frames);
  EXPECT_NE(scene.reference[0].seed, scene.reference[1].seed);
}

TEST_F(StudyTest, EveryFaultHasItsPath) {
  const auto study = [](const std::string& scene, const std::string& method,
                        const std::string& rest) {
    return R"({"name": "s", "scenes": [{"name": "a", )" + scene +
           R"(}], "methods": [{"name": "m", )" + method + "}]" + rest + "}";
  };
  const std::string job = R"("job": "job.json")", plain = R"("patch": {})";
  struct Case {
    std::string text, path, message;
  };
  const Case cases[] = {
      {"[]", "$", "expected an object"},
      {"{}", "$.name", "expected a name"},
      {"{}", "$.scenes", "at least one element"},
      {"{}", "$.methods", "at least one element"},
      {study(job, plain, R"(, "sedes": 3)"), "$.sedes", "unknown key; did you mean \"seeds\"?"},
      {study(job, plain, R"(, "seeds": 0)"), "$.seeds", "an integer in [1, 10000], got 0"},
      {study(job, plain, R"(, "referenceSamples": 1)"), "$.referenceSamples", "an integer in [2,"},
      {study(job, plain, R"(, "patch": 3)"), "$.patch", "expected an object to merge"},
      {study(job, plain, R"(, "measureFrames": "9")"), "$.measureFrames",
       "expected frames of the job (1-8), got 9"},
      {study(job, plain, R"(, "measureFrames": "x")"), "$.measureFrames", "expected"},
      {study(R"("job": "no.json")", plain, ""), "$.scenes[0].job", "no.json"},
      {study(job + R"(, "crop": [0, 0, 33, 1])", plain, ""), "$.scenes[0].crop",
       "inside of 32 x 16 pixels"},
      {study(job + R"(, "cutFrame": 1)", plain, ""), "$.scenes[0].cutFrame",
       "expected a measured frame after the first (1-8), got 1"},
      {study(job + R"(, "patch": {"image": {"width": "wide"}})", plain, ""),
       "$.scenes[0].patch.image.width", "expected an integer"},
      {study(job, R"("patch": {"sampling": {"metod": "mis"}})", ""),
       "$.methods[0].patch.sampling.metod", "unknown key; did you mean \"method\"?"},
      {study(job, R"("patch": {"sampling": {"method": "mys"}})", ""),
       "$.methods[0].patch.sampling.method", "did you mean \"mis\"?"},
      {study(job, plain, R"(, "budgets": [4, 4])"), "$.budgets[1]", "\"4\" twice"},
      {study(job, plain, R"(, "budgets": [1000])"), "$.budgets[0].sampling.numParticles",
       "expected an integer in"},
      {study(job, R"("budgets": [{"name": "x", "patch": {"seed": -1}}])", ""),
       "$.methods[0].budgets[0].patch.seed", "expected an integer"},
      {study(job, R"("patch": {}}, {"name": "m")", ""), "$.methods[1]", "\"m\" twice"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(fault(c.text), HasSubstr("study.json: " + c.path + ": ")) << c.text;
    EXPECT_THAT(fault(c.text), HasSubstr(c.message)) << c.text;
  }
}

TEST_F(StudyTest, AFaultOfTheJobItselfNamesTheJob) {
  const std::string text = R"({"name": "s", "patch": {"frames": "1-2"}, "methods": [{"name": "m"}],
    "scenes": [{"name": "a", "job": "job.json", "patch": {"environment": {"keys": []}}}]})";
  EXPECT_THAT(fault(text),
              HasSubstr("study.json: $.scenes[0].patch.environment: expected exactly"));
}

TEST_F(StudyTest, RecordsKeepEveryNumber) {
  RunRecord record{.key = "k",
                   .counts = {},
                   .state_bytes = 5,
                   .state_pixels = 2,
                   .frames_rendered = 3,
                   .frames = {}};
  record.counts = {.pixels = 11,
                   .pixels_background = 12,
                   .rays_shadow = 13,
                   .target_evaluations = 14,
                   .moves_proposed = 15,
                   .pixels_resampled = 16,
                   .pixels_restarted = 17,
                   .cpu_seconds = 0.1,
                   .seconds_light = 0.2,
                   .seconds_primary = 0.3,
                   .seconds_sample = 0.4,
                   .seconds_visibility = 0.5,
                   .seconds_shade = 0.6,
                   .seconds_second_pass = 0.7};
  record.frames.push_back({.frame = FrameNumber(4),
                           .mse = 0.1 + 0.2,
                           .flicker = kNotMeasured,
                           .block_mse = {0.1, 0.2}});
  ASSERT_TRUE(write_record(folder_ / "r.json", record));
  const std::optional<RunRecord> read = read_record(folder_ / "r.json");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->key, "k");
  EXPECT_EQ(read->counts, record.counts);
  EXPECT_EQ(read->frames_rendered, 3u);
  EXPECT_EQ(read->frames[0].mse, record.frames[0].mse);
  EXPECT_TRUE(std::isnan(read->frames[0].flicker));
}

TEST_F(StudyTest, ADamagedRecordIsNone) {
  std::ofstream(folder_ / "r.json") << R"({"key": "k")";
  EXPECT_FALSE(read_record(folder_ / "r.json"));
  EXPECT_FALSE(read_record(folder_ / "none.json"));
}

}  // namespace
}  // namespace baton
