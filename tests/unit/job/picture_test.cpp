#include "common/job/picture.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

/// A job with the required keys and `more`.
JobSpec job_with(const std::string& more) {
  const std::string text = R"({"name": "test", "scene": {}, "environment": {"map": "sky.exr"})" +
                           (more.empty() ? "" : ", " + more) + "}";
  Result<JobSpec> job = parse_job(text, "job.json", "/jobs");
  EXPECT_TRUE(job.ok()) << (job.ok() ? "" : job.error().message);
  return job.ok() ? std::move(job).value() : JobSpec{};
}

// Settings may change without another picture; everything else is named.
TEST(Picture, NamesWhatDecidesPixelsAlone) {
  const auto document = [](const std::string& keys) {
    return ParsedJobDocument{.job = job_with(keys), .assets = {}, .digest = {}, .picture = {}};
  };
  const ParsedJobDocument plain = document("");
  for (const char* setting :
       {R"("priority": 7)", R"("metadata": {"a": "b"})", R"("frames": "1-8")",
        R"("image": {"tileSize": 32})", R"("output": {"compression": "rle"})",
        R"("state": {"checkpointEvery": 3})", R"("maxRetriesPerTask": 1)", R"("maxFailedTasks": 3)",
        R"("maxFailuresPerWorker": 2)", R"("maxSecondsPerTask": 77)"}) {
    const auto differences = picture_differences(plain, document(setting));
    EXPECT_TRUE(differences.empty()) << setting << " " << differences.front();
    EXPECT_EQ(picture_digest(plain.job, {}), picture_digest(document(setting).job, {})) << setting;
  }
  EXPECT_EQ(picture_differences(plain, document(R"("seed": 3)")),
            std::vector{std::string("$.seed")});
  EXPECT_EQ(picture_differences(plain, document(R"("state": {"carry": false})")),
            std::vector{std::string("$.state.carry")});
  EXPECT_NE(picture_digest(plain.job, {}), picture_digest(document(R"("seed": 3)").job, {}));
  // Where samples are carried the history begins with the first frame.
  EXPECT_EQ(picture_differences(plain, document(R"("frames": "2-8")")).size(), 1u);
}

}  // namespace
}  // namespace baton
