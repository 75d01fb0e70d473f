#include <gtest/gtest.h>

#include "common/job/plan/next_sweeps.h"
#include "common/job/text/job_json.h"
#include "common/job/text/picture.h"

namespace baton {
namespace {

/// Faults of a small job with `more` keys; empty: none.
std::string quality_faults(const std::string& more) {
  const std::string text =
      R"({"name": "a", "environment": {"map": "a.exr"}, "scene": {)"
      R"("materials": {"m": {"type": "diffuse"}}, "ground": {"material": "m"}}, )" +
      more + "}";
  const auto job = parse_job(text, "job.json", "/jobs");
  return job.ok() ? "" : job.error().message;
}

TEST(Quality, RoundsGoWithNeitherASecondPassNorAuto) {
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 2}, "sampling": {"method": "mis"})"), "");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 2}, "sampling": {"method": "auto"})"),
            "job.json: $.quality.rounds: expected 1, as sampling.method is auto, which chooses for "
            "one, got 2");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 2}, "sampling": {"method": "mis"},
                      "visibility": {"correlated": true})"),
            "job.json: $.visibility.correlated: expected false, as quality.rounds is 2, and the "
            "second pass takes one round, got true");
}

TEST(Quality, FineSitesAreForMethodsWhoseSamplesBelongToNone) {
  EXPECT_EQ(quality_faults(R"("image": {"maxSites": 64}, "sampling": {"method": "pool"})"), "");
  EXPECT_EQ(quality_faults(R"("image": {"maxSites": 64}, "sampling": {"method": "sequential"},
                      "state": {"carry": false})"),
            "");
  EXPECT_EQ(
      quality_faults(R"("image": {"maxSites": 64}, "sampling": {"method": "sequential"})"),
      "job.json: $.image: expected no maxSites, as the samples that sequential carries belong "
      "to sites, got 64");
  EXPECT_EQ(quality_faults(R"("image": {"maxSites": 64}, "sampling": {"method": "mis"},
                      "visibility": {"correlated": true})"),
            "job.json: $.image: expected no maxSites, as visibility.correlated has pixels of equal "
            "sites, got 64");
  EXPECT_EQ(quality_faults(R"("image": {"maxSites": 64}, "sampling": {"method": "auto"})"),
            "job.json: $.image: expected no maxSites, as auto may choose a method whose samples "
            "belong to sites, got 64");
}

TEST(Quality, SweepsAreBoundedAndNoiseMustBeKnown) {
  EXPECT_EQ(quality_faults(R"("quality": {"sweeps": 3, "noiseThreshold": 0.01, "maxRounds": 64})"),
            "");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 256, "sweeps": 257})"),
            "job.json: $.quality.sweeps: expected at most 65536 rounds in all sweeps, got 65792");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 3, "adaptiveThreshold": 0.01})"), "");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 2, "adaptiveThreshold": 0.01})"),
            "job.json: $.quality: expected no adaptiveThreshold, as the first 2 of "
            "quality.rounds judge, and there are 2, got 0.01");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 8, "adaptiveThreshold": 0.01},
                      "sampling": {"method": "sequential"})"),
            "job.json: $.quality: expected no adaptiveThreshold, as the rounds of sequential go on "
            "from each other where it carries samples, got 0.01");
  EXPECT_EQ(quality_faults(R"("quality": {"rounds": 16, "maxRounds": 8})"),
            "job.json: $.quality.maxRounds: expected 0, or at least quality.rounds, 16, got 8");
  EXPECT_EQ(quality_faults(R"("quality": {"sweeps": 2}, "sampling": {"method": "auto"})"),
            "job.json: $.quality.sweeps: expected 1, as sampling.method is auto, which chooses for "
            "one, got 2");
  EXPECT_EQ(quality_faults(R"("quality": {"timeLimit": 9}, "sampling": {"method": "mis"},
                      "visibility": {"correlated": true})"),
            "job.json: $.visibility.correlated: expected false, as quality asks for sweeps, and "
            "the frames of a second pass have no mean, got true");
  EXPECT_EQ(
      quality_faults(R"("quality": {"noiseThreshold": 0.5}, "sampling": {"method": "sequential"})"),
      "job.json: $.quality: expected no noiseThreshold, as the noise of sequential is not "
      "known where it carries samples, got 0.5");
}

TEST(Quality, SweepsAreDoubledUntilNoiseTimeOrRoundsEndThem) {
  QualitySpec quality{.rounds = 4, .sweeps = 2, .max_rounds = 40};
  EXPECT_EQ(next_sweeps(quality, 0.1f, 1, 2), 4);
  quality.sweeps = 8;
  EXPECT_EQ(next_sweeps(quality, 0.1f, 1, 2), 10) << "40 rounds";
  quality.sweeps = 10;
  EXPECT_EQ(next_sweeps(quality, 0.1f, 1, 2), 10);

  quality = {.rounds = 4, .sweeps = 4, .noise_threshold = 0.05f};
  EXPECT_EQ(next_sweeps(quality, 0.06f, 1, 4), 6) << "4 (6 / 5)^2 = 5.76";
  EXPECT_EQ(next_sweeps(quality, 0.2f, 1, 4), 8);
  EXPECT_EQ(next_sweeps(quality, 0.05f, 1, 4), 4);
  EXPECT_EQ(next_sweeps(quality, 0, 1, 4), 8) << "not known";

  quality = {.rounds = 1, .sweeps = 4, .time_limit = 10.0f};
  EXPECT_EQ(next_sweeps(quality, 0, 4, 4), 8);
  EXPECT_EQ(next_sweeps(quality, 0, 8, 4), 5) << "a sweep takes 2 s";
  EXPECT_EQ(next_sweeps(quality, 0, 9, 4), 4);
  EXPECT_EQ(next_sweeps(quality, 0, 30, 4), 4) << "never fewer";
  EXPECT_EQ(next_sweeps(quality, 0, -86400, 4), 4) << "the clock was set back";
}

TEST(Quality, RoundsAndPrerollChangeThePicture) {
  const auto differences = [](const auto& change) {
    ParsedJobDocument a{.job = {}, .assets = {}, .digest = {}, .picture = {}};
    a.job.name = "a";
    ParsedJobDocument b = a;
    change(b.job);
    a.picture = picture_digest(a.job, a.assets);
    b.picture = picture_digest(b.job, b.assets);
    return picture_differences(a, b);
  };
  EXPECT_EQ(differences([](JobSpec& job) { job.state.preroll = 1; }),
            std::vector{std::string("$.state.preroll")});
  EXPECT_TRUE(differences([](JobSpec& job) { job.quality.sweeps = 2; }).empty());
  EXPECT_TRUE(differences([](JobSpec& job) { job.quality.noise_threshold = 2.0f; }).empty());
  EXPECT_EQ(differences([](JobSpec& job) { job.quality.rounds = 2; }),
            std::vector{std::string("$.quality.rounds")});
  EXPECT_TRUE(differences([](JobSpec& job) { job.state.checkpoint_every = 3; }).empty());
}

}  // namespace
}  // namespace baton
