#include "common/job/aov.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "common/job/text/picture.h"

namespace baton {
namespace {

std::vector<Aov> aovs_of(const std::string& list) {
  const Result<JobSpec> job = parse_job(
      R"({"name": "a", "scene": {}, "environment": {"map": "a.exr"}, "output": {"aovs": )" + list +
          "}}",
      "a.json", "/");
  EXPECT_TRUE(job.ok()) << (job.ok() ? "" : job.error().message);
  return job.ok() ? job->output.aovs : std::vector<Aov>{};
}

TEST(Aovs, DenoiseStandsForWhatDenoisersTake) {
  const std::vector<Aov> plain = aovs_of(R"(["albedo", "normal", "variance", "motion"])");
  EXPECT_EQ(plain.size(), 4);
  EXPECT_EQ(aovs_of(R"(["denoise"])"), plain);
  EXPECT_EQ(aovs_of(R"(["normal", "denoise"])"), plain);
  EXPECT_EQ(aovs_of(R"(["denoise", "depth"])"),
            aovs_of(R"(["albedo", "normal", "variance", "motion", "depth"])"));
}

TEST(Aovs, ASetIsWrittenAsItsMembers) {
  JobSpec job;
  job.output.aovs = aovs_of(R"(["denoise"])");
  EXPECT_THAT(to_json(job), testing::Not(testing::HasSubstr("denoise")));
}

TEST(Aovs, LightHasThreeChannelsOf32Bits) {
  for (const Aov aov : {Aov::variance, Aov::unshadowed, Aov::blocked}) {
    EXPECT_TRUE(traits(aov).is_float);
    ASSERT_EQ(traits(aov).channels.size(), 3u);
    EXPECT_TRUE(traits(aov).channels[1].ends_with(".G"));
  }
}

std::string fault_of(const std::string& sampling, const std::string& rest = "") {
  const Result<JobSpec> job =
      parse_job(R"({"name": "a", "scene": {}, "environment": {"map": "a.exr"}, "sampling": {)" +
                    sampling + R"(}, "output": {"aovs": ["unshadowed"]})" + rest + "}",
                "a.json", "/");
  return job.ok() ? "none" : job.error().message;
}

TEST(Aovs, WhoForgetsWhatIsBlockedKnowsNoLightWithoutShadows) {
  EXPECT_EQ(fault_of(R"("method": "pool")"), "none");
  EXPECT_EQ(fault_of(R"("method": "restir")"), "none");
  const std::string forgets = R"("method": "restir", "reuseVisibility": true)";
  EXPECT_EQ(fault_of(forgets, R"(, "state": {"carry": false})"), "none");
  EXPECT_EQ(fault_of(forgets),
            "a.json: $.output: expected no unshadowed among aovs, as samples that were blocked are "
            "forgotten (sampling.reuseVisibility), got \"unshadowed\"");
  EXPECT_EQ(
      fault_of(R"("method": "bidirectional")", R"(, "visibility": {"correlated": true})"),
      "a.json: $.output: expected no unshadowed among aovs, as the second pass exchanges shadows "
      "between pixels, got \"unshadowed\"");
}

TEST(Aovs, TheVarianceOfASingleRoundIsASecondDraw) {
  JobSpec job;
  job.output.aovs = {Aov::variance};
  job.sampling.method = Method::pool;
  EXPECT_TRUE(draws_twice(job));
  job.quality.rounds = 2;
  EXPECT_FALSE(draws_twice(job)) << "their scatter tells";
  job.quality.rounds = 1;
  for (const Method method : {Method::reference, Method::sequential, Method::restir}) {
    job.sampling.method = method;
    EXPECT_FALSE(draws_twice(job)) << static_cast<int>(method);
    EXPECT_EQ(why_empty(Aov::variance, job).empty(), method == Method::reference);
  }
  job.state.carry = false;
  EXPECT_TRUE(draws_twice(job)) << "samples are fresh";
  job.output.aovs = {Aov::depth};
  EXPECT_FALSE(draws_twice(job));
}

TEST(Aovs, NoTwoObjectsHaveOneNameUnlessItIsGiven) {
  JobSpec job;
  for (const char* mesh : {"b", "b", "b.2", "ground", "b", "hero"})
    job.scene.objects.push_back({.mesh = mesh, .material = "m"});
  job.scene.ground.emplace();
  EXPECT_THAT(object_names(job),
              testing::ElementsAre("b", "b.3", "b.2", "ground", "b.4", "hero", "ground.2"));
  job.scene.objects[0].name = job.scene.objects[1].name = "hero";
  job.scene.objects[2].name = "ground";
  EXPECT_THAT(object_names(job), testing::ElementsAre("hero", "hero", "ground", "ground.2", "b",
                                                      "hero.2", "ground.3"));
}

TEST(Aovs, NamesOfObjectsAreSeenInMattesAlone) {
  JobSpec one;
  one.scene.objects.push_back({.mesh = "b", .material = "m"});
  JobSpec other = one;
  other.scene.objects[0].name = "hero";
  EXPECT_TRUE(mattes_alike(one, other));
  EXPECT_EQ(picture_digest(one, {}), picture_digest(other, {}));
  one.output.aovs = other.output.aovs = {Aov::crypto_object};
  EXPECT_FALSE(mattes_alike(one, other));
  EXPECT_EQ(picture_digest(one, {}), picture_digest(other, {}));
}

}  // namespace
}  // namespace baton
