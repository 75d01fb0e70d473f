#include "common/job/text/picture.h"

#include <gmock/gmock.h>
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
    const JobSpec job = job_with(keys);
    return ParsedJobDocument{
        .job = job, .assets = {}, .digest = {}, .picture = picture_digest(job, {})};
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
    const std::string text(setting);
    const bool is_told_apart = text.starts_with("\"frames") || text.starts_with("\"priority");
    EXPECT_EQ(setting_differences(plain.job, document(setting).job).empty(), is_told_apart)
        << setting;
  }
  EXPECT_EQ(setting_differences(plain.job, document(R"("metadata": {"a": "b"}, "seed": 3,
                "output": {"aovs": ["depth"], "compression": "rle"})")
                                               .job),
            (std::vector<std::string>{"$.metadata.a", "$.output.aovs", "$.output.compression"}));
  EXPECT_EQ(picture_differences(plain, document(R"("seed": 3)")),
            std::vector{std::string("$.seed")});
  EXPECT_EQ(picture_differences(plain, document(R"("state": {"carry": false})")),
            std::vector{std::string("$.state.carry")});
  EXPECT_NE(picture_digest(plain.job, {}), picture_digest(document(R"("seed": 3)").job, {}));
  // Where samples are carried the history begins with the first frame.
  EXPECT_EQ(picture_differences(plain, document(R"("frames": "2-8")")).size(), 1u);
}

// Jobs from before light between surfaces are the pictures that they were.
TEST(Picture, LightBetweenSurfacesIsNamedWhereThereIsSome) {
  const auto document = [](const std::string& keys) {
    const JobSpec job = job_with(keys);
    return ParsedJobDocument{
        .job = job, .assets = {}, .digest = {}, .picture = picture_digest(job, {})};
  };
  const ParsedJobDocument plain = document(""), lit = document(R"("light": {"bounces": 2})");
  EXPECT_TRUE(picture_differences(plain, document(R"("light": {"filterGlossy": false})")).empty());
  EXPECT_EQ(picture_differences(plain, lit),
            (std::vector<std::string>{"$.light.bounces", "$.light.filterGlossy"}));
  EXPECT_EQ(picture_differences(lit, document(R"("light": {"bounces": 2, "filterGlossy": false})")),
            std::vector{std::string("$.light.filterGlossy")});
}

// A plate is laid under what is rendered: other plates make other frames of the same films.
TEST(Picture, PlatesBelongToFramesAlone) {
  const auto document = [](const std::string& output, const Digest& second) {
    return ParsedJobDocument{
        .job = job_with(R"("frames": "1-2", "output": {"pattern": "f.#.exr", )" + output + "}"),
        .assets = {{"/jobs/a.1.png", {1, 1}}, {"/jobs/a.2.png", second}, {"/jobs/sky.exr", {3, 3}}},
        .digest = {},
        .picture = {}};
  };
  const auto plated = [&](const Digest& second) {
    return document(R"("background": "plate", "plate": "a.#.png")", second);
  };
  const ParsedJobDocument one = plated({2, 2}), other = plated({7, 7});
  const ParsedJobDocument none = document(R"("background": "transparent")", {2, 2});
  EXPECT_EQ(picture_digest(one.job, one.assets), picture_digest(other.job, other.assets));
  EXPECT_TRUE(picture_differences(one, other).empty());
  const FrameComparison comparison(one, other);
  EXPECT_TRUE(comparison.are_equal(FrameIndex(1), FrameIndex(1)));
  EXPECT_TRUE(comparison.have_one_plate(FrameIndex(0), FrameIndex(0)));
  EXPECT_FALSE(comparison.have_one_plate(FrameIndex(1), FrameIndex(1)));
  EXPECT_FALSE(FrameComparison(one, none).have_one_plate(FrameIndex(0), FrameIndex(0)));
  EXPECT_THAT(asset_paths(one.job),
              testing::ElementsAre("/jobs/a.1.png", "/jobs/a.2.png", "/jobs/sky.exr"));
  EXPECT_THAT(asset_paths(none.job), testing::ElementsAre("/jobs/sky.exr"));
}

}  // namespace
}  // namespace baton
