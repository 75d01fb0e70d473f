#include <gtest/gtest.h>

#include "common/job/job_json.h"
#include "common/job/picture.h"

namespace baton {
namespace {

/// Faults of a small job with `more` keys; empty: none.
std::string faults(const std::string& more) {
  const std::string text =
      R"({"name": "a", "environment": {"map": "a.exr"}, "scene": {)"
      R"("materials": {"m": {"type": "diffuse"}}, "ground": {"material": "m"}}, )" +
      more + "}";
  const auto job = parse_job(text, "job.json", "/jobs");
  return job.ok() ? "" : job.error().message;
}

TEST(Quality, RoundsGoWithNeitherASecondPassNorAuto) {
  EXPECT_EQ(faults(R"("quality": {"rounds": 2}, "sampling": {"method": "mis"})"), "");
  EXPECT_EQ(faults(R"("quality": {"rounds": 2}, "sampling": {"method": "auto"})"),
            "job.json: $.quality.rounds: expected 1, as sampling.method is auto, which chooses for "
            "one, got 2");
  EXPECT_EQ(faults(R"("quality": {"rounds": 2}, "sampling": {"method": "mis"},
                      "visibility": {"correlated": true})"),
            "job.json: $.visibility.correlated: expected false, as quality.rounds is 2, and the "
            "second pass takes one round, got true");
}

TEST(Quality, RoundsAndPrerollChangeThePicture) {
  const auto differences = [](const auto& change) {
    ParsedJobDocument a{.job = {}, .assets = {}, .digest = {}, .picture = {}};
    a.job.name = "a";
    ParsedJobDocument b = a;
    change(b.job);
    return picture_differences(a, b);
  };
  EXPECT_EQ(differences([](JobSpec& job) { job.state.preroll = 1; }),
            std::vector{std::string("$.state.preroll")});
  EXPECT_EQ(differences([](JobSpec& job) { job.quality.rounds = 2; }),
            std::vector{std::string("$.quality.rounds")});
  EXPECT_TRUE(differences([](JobSpec& job) { job.state.checkpoint_every = 3; }).empty());
}

}  // namespace
}  // namespace baton
