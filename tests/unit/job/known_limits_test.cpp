#include "common/advice/known_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "common/job/text/frame_range.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A turning light on one material.
JobSpec turning(Method method, double deg, const MaterialSpec& material) {
  JobSpec job;
  job.frames = parse_frames("1-3").value();
  job.sampling.method = method;
  job.environment.rotation_deg_per_frame = deg;
  job.scene.materials["only"] = material;
  return job;
}

const MaterialSpec kChalk{};
const MaterialSpec kLacquer{.kind = MaterialKind::phong, .exponent = 50};
const MaterialSpec kChrome{
    .kind = MaterialKind::metallic_roughness, .metallic = 1, .roughness = 0.1f};

TEST(KnownLimits, AreTheVerdictsOfTheStabilitySuite) {
  std::ifstream file(std::string(BATON_SOURCE_DIR) + "/jobs/lab/stability/expected.csv");
  const auto parts_of = [&file] {
    std::vector<std::string> parts;
    std::string line;
    std::getline(file, line);
    std::istringstream text(line);
    for (std::string part; std::getline(text, part, ',');) parts.push_back(part);
    return parts;
  };
  std::map<std::string, std::string> verdicts;
  const std::vector<std::string> subjects = parts_of();
  for (auto row = parts_of(); row.size() == subjects.size(); row = parts_of()) {
    for (std::size_t s = 1; s < row.size(); ++s)
      verdicts[row[0] + "," + subjects[s]] = row[s].substr(0, row[s].find('/'));
  }
  ASSERT_GT(verdicts.size(), 600u);
  for (const KnownLimit& limit : known_limits()) {
    const std::string key = std::string(limit.test_case) + "," + std::string(limit.subject);
    EXPECT_EQ(verdicts[key], limit.verdict) << key;
    const std::string of_pool = verdicts[std::string(limit.test_case) + ",pool"];
    EXPECT_NE(of_pool, limit.verdict) << "what is offered instead";
    EXPECT_NE(of_pool, "fails");
    if (limit.light == KnownLimit::Light::turns) {
      EXPECT_NE(std::string(limit.test_case).find("turn-"), std::string::npos);
      EXPECT_EQ(std::stod(std::string(limit.test_case).substr(5)), limit.from_deg) << key;
    }
  }
}

TEST(KnownLimits, SequentialIsWarnedOfFromTheTurnsThatItFailsAt) {
  EXPECT_THAT(limit_warnings(turning(Method::sequential, 15, kLacquer), false),
              ElementsAre(testing::AllOf(HasSubstr("turns 15 degrees a frame"),
                                         HasSubstr("`sequential` fails from 1.5"))));
  EXPECT_THAT(limit_warnings(turning(Method::sequential, 1.4, kLacquer), false), IsEmpty());
  EXPECT_THAT(limit_warnings(turning(Method::sequential, -1.5, kLacquer), false),
              ElementsAre(HasSubstr("fails from 1.5")));
  EXPECT_THAT(limit_warnings(turning(Method::sequential, 1.5, kChalk), false),
              ElementsAre(HasSubstr("degrades from 0.7 on diffuse")));
  EXPECT_THAT(limit_warnings(turning(Method::sequential, 359.9, kLacquer), false), IsEmpty())
      << "a tenth of a degree the other way";
}

TEST(KnownLimits, PublishedFormsFailEarlier) {
  JobSpec job = turning(Method::sequential, 0.7, kLacquer);
  job.sampling.refresh_every = 0;
  EXPECT_THAT(limit_warnings(job, false), ElementsAre(HasSubstr("refreshEvery 0 fails from 0.7")));
}

TEST(KnownLimits, FramesThatAreLeftOutCount) {
  JobSpec job = turning(Method::sequential, 1, kLacquer);
  job.frames = parse_frames("1-5x2").value();
  EXPECT_EQ(turn_deg_per_frame(job), 2);
  EXPECT_THAT(limit_warnings(job, false), ElementsAre(HasSubstr("turns 2 degrees")));
}

TEST(KnownLimits, JumpsAndMirrors) {
  EXPECT_THAT(limit_warnings(turning(Method::sequential, 0, kChalk), true),
              ElementsAre(HasSubstr("the light jumps: `sequential` fails")));
  EXPECT_THAT(limit_warnings(turning(Method::restir, 0.1, kChrome), false),
              ElementsAre(HasSubstr("`restir` fails from 0.1 on near mirrors")));
  EXPECT_THAT(limit_warnings(turning(Method::environment, 0, kChrome), false),
              ElementsAre(HasSubstr("fails by its noise on near mirrors")));
}

TEST(KnownLimits, WhatHoldsIsNotWarnedOf) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::ratio}) {
    for (const MaterialSpec& material : {kChalk, kLacquer, kChrome})
      EXPECT_THAT(limit_warnings(turning(method, 45, material), true), IsEmpty());
  }
}

}  // namespace
}  // namespace baton
