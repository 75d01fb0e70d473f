#include "common/job/aov.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/job/job_json.h"

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

}  // namespace
}  // namespace baton
