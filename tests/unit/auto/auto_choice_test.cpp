#include "jobs/auto/auto_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "jobs/auto/auto_pilot.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

PilotNumbers numbers(const std::string& family, int n, double error, double cost_us) {
  PilotNumbers result{{family, {}, false}, error, cost_us};
  result.candidate.sampling.num_particles = n;
  return result;
}

JobSpec automatic_job() {
  return parse_job(R"({"name": "job", "frames": "1",
                       "scene": {"materials": {"grey": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
                                 "ground": {"material": "grey"}},
                       "environment": {"map": "sky.exr"},
                       "sampling": {"method": "auto"}})",
                   "job.json", "/")
      .value();
}

TEST(AutoChoice, TakesTheBestEfficiencyAtTheGivenN) {
  const std::vector<PilotNumbers> pilot{numbers("a", 16, 0.2, 2), numbers("b", 16, 0.1, 4)};
  const AutoChoice choice = choose_sampling(automatic_job(), pilot, 1);
  EXPECT_EQ(choice.error, 0.1);  // 1 / (.01 * 4) = 25 against 1 / (.04 * 2) = 12.5
  EXPECT_THAT(choice.reason, HasSubstr("at N = 16"));
}

TEST(AutoChoice, AMoreComplicatedOneMustGainFivePercent) {
  const std::vector<PilotNumbers> even{numbers("a", 16, 0.1, 1.04), numbers("b", 16, 0.1, 1)};
  EXPECT_EQ(choose_sampling(automatic_job(), even, 1).cost_us, 1.04);
  const std::vector<PilotNumbers> better{numbers("a", 16, 0.1, 1.06), numbers("b", 16, 0.1, 1)};
  EXPECT_EQ(choose_sampling(automatic_job(), better, 1).cost_us, 1);
}

TEST(AutoChoice, InterpolatesNToTheTargetError) {
  JobSpec job = automatic_job();
  job.sampling.target_error = 0.1f;
  // error = .4 / sqrt(N / 4): 0.1 at N = 64; cost = N.
  const std::vector<PilotNumbers> pilot{numbers("a", 4, 0.4, 4),
                                        numbers("a", 32, 0.4 / std::sqrt(8), 32)};
  const AutoChoice choice = choose_sampling(job, pilot, 1);
  EXPECT_EQ(choice.sampling.num_particles, 64);
  EXPECT_NEAR(choice.error, 0.1, 1e-9);
  EXPECT_NEAR(choice.cost_us, 64, 1e-9);
}

TEST(AutoChoice, SaysWhenTheTargetIsOutOfReach) {
  JobSpec job = automatic_job();
  job.sampling.target_error = 0.01f;
  const std::vector<PilotNumbers> pilot{numbers("a", 4, 0.4, 4), numbers("a", 32, 0.2, 32)};
  const AutoChoice choice = choose_sampling(job, pilot, 1);
  EXPECT_EQ(choice.sampling.num_particles, 64);
  EXPECT_THAT(choice.reason, HasSubstr("none reaches"));
}

TEST(AutoChoice, StaysWithinTheTimeBudget) {
  JobSpec job = automatic_job();
  job.sampling.time_budget = 0.017f;  // 17 us for each of 1000 pixels
  const std::vector<PilotNumbers> pilot{numbers("a", 4, 0.4, 4), numbers("a", 32, 0.2, 32)};
  EXPECT_EQ(choose_sampling(job, pilot, 1000).sampling.num_particles, 16);
  job.sampling.time_budget = 0.0001f;
  EXPECT_EQ(choose_sampling(job, pilot, 1000).sampling.num_particles, 1);
}

TEST(AutoCandidates, NothingIsCarriedWhereThereIsOneFrame) {
  const auto carries = [](const JobSpec& job) {
    for (const AutoCandidate& candidate : auto_candidates(job)) {
      if (candidate.sampling.method == Method::sequential) return true;
    }
    return false;
  };
  JobSpec job = automatic_job();
  EXPECT_FALSE(carries(job));
  job.frames = parse_frames("1-2").value();
  EXPECT_TRUE(carries(job));
  job.state.carry = false;
  EXPECT_FALSE(carries(job));
}

TEST(AutoCandidates, SecondPassTakesEvenNumbersAndNoPool) {
  const auto tries_pool = [](const JobSpec& job) {
    bool found = false;
    for (const AutoCandidate& candidate : auto_candidates(job)) {
      EXPECT_TRUE(!candidate.correlated || candidate.sampling.num_particles % 2 == 0);
      found = found || candidate.sampling.method == Method::pool;
    }
    return found;
  };
  JobSpec job = automatic_job();
  job.frames = parse_frames("1-2").value();
  EXPECT_TRUE(tries_pool(job));
  job.sampling.num_particles = 3;
  EXPECT_TRUE(tries_pool(job));
  job.sampling.num_particles = 4;
  job.visibility.correlated = true;
  EXPECT_FALSE(tries_pool(job));
}

// Whatever the pilot chooses, the job must be legal with it.
TEST(AutoCandidates, SuitTheWholeJob) {
  const auto has = [](const JobSpec& job, const auto& is) {
    return std::ranges::any_of(auto_candidates(job), is);
  };
  const auto correlated = [](const AutoCandidate& c) { return c.correlated; };
  const auto sequential = [](const AutoCandidate& c) {
    return c.sampling.method == Method::sequential;
  };
  JobSpec job = automatic_job();
  job.frames = parse_frames("1-2").value();
  EXPECT_TRUE(has(job, correlated));
  EXPECT_TRUE(has(job, sequential));
  JobSpec catches = job;
  catches.scene.ground->catcher = true;
  EXPECT_FALSE(has(catches, correlated));
  JobSpec shows = job;
  shows.output.aovs = {Aov::unshadowed};
  EXPECT_FALSE(has(shows, correlated));
  JobSpec adapts = job;
  adapts.quality.rounds = 16;
  adapts.quality.adaptive_threshold = 0.01;
  EXPECT_FALSE(has(adapts, sequential));
  EXPECT_TRUE(
      has(adapts, [](const AutoCandidate& c) { return c.sampling.method == Method::pool; }));
}

TEST(AutoCandidates, PoolComesWithFewCandidatesFirst) {
  JobSpec job = automatic_job();
  job.frames = parse_frames("1-2").value();
  std::vector<int> num_candidates;
  for (const AutoCandidate& candidate : auto_candidates(job)) {
    if (candidate.sampling.method == Method::pool)
      num_candidates.push_back(candidate.sampling.num_candidates);
  }
  EXPECT_THAT(num_candidates, ElementsAre(64, 128, 256, 512));
}

TEST(AutoCandidates, AreSettledThemselves) {
  JobSpec job = automatic_job();
  job.frames = parse_frames("1-2").value();
  job.sampling.target_error = 0.1f;
  for (const AutoCandidate& candidate : auto_candidates(job)) {
    EXPECT_NE(candidate.sampling.method, Method::automatic);
    EXPECT_FALSE(candidate.sampling.target_error);
    EXPECT_GE(candidate.sampling.num_candidates, candidate.sampling.num_particles);
  }
}

TEST(AutoChoice, IsWrittenIntoTheJob) {
  JobSpec job = automatic_job();
  const std::vector<PilotNumbers> pilot{numbers("a", 16, 0.2, 2)};
  apply_choice({pilot[0].candidate.sampling, true, 0.2, 2, "because"}, pilot, job);
  EXPECT_TRUE(job.visibility.correlated);
  EXPECT_EQ(job.sampling, pilot[0].candidate.sampling);
  EXPECT_EQ(job.metadata["auto.reason"], "because");
  EXPECT_EQ(job.metadata["auto.pilot"], "a N=16: error 0.2000, 2.00 us");
}

TEST(PilotPlan, GrowsWithTheCandidatesAndTheirSamples) {
  JobSpec job = automatic_job();
  job.image = {.width = 640, .height = 360};
  job.frames = parse_frames("1-3").value();
  const PilotPlan one = plan_pilot(job, 1);
  EXPECT_EQ(one.windows, 1u);
  EXPECT_EQ(one.candidates, auto_candidates(job).size());
  EXPECT_EQ(one.pixels, 64 * 36);
  EXPECT_GT(one.frames, one.candidates * 3 * 3);
  EXPECT_GT(one.cpu_seconds, 0.5);
  EXPECT_LT(one.cpu_seconds, 60);
  EXPECT_GT(plan_pilot(job, 3).cpu_seconds, 1.2 * one.cpu_seconds) << "dearer rays";
  job.frames = parse_frames("1-48").value();
  EXPECT_GT(plan_pilot(job, 1).cpu_seconds, 2 * one.cpu_seconds);
}

TEST(PilotStudy, LooksAtTheStartAndTheEndOfALongJob) {
  JobSpec job = automatic_job();
  job.image = {.width = 640, .height = 360};
  job.frames = parse_frames("1-48").value();
  const Study study = pilot_study(job, auto_candidates(job));
  ASSERT_EQ(study.scenes.size(), 2u);
  EXPECT_EQ(format_frames(study.scenes[0].frames), "11-12");
  EXPECT_EQ(format_frames(study.scenes[1].frames), "47-48");
  const JobSpec& end = study.scenes[1].reference[0];
  EXPECT_EQ(format_frames(end.frames), "47-48");
  EXPECT_EQ(end.image.width, 64);
  EXPECT_EQ(end.image.height, 36);

  // Candidates and reference see the same points, whatever their seeds.
  EXPECT_GT(end.image.site_seed, 0u);
  for (const StudyCell& cell : study.cells)
    EXPECT_EQ(cell.job.image.site_seed, end.image.site_seed);

  // A short one is looked at once.
  job.frames = parse_frames("1-3").value();
  EXPECT_EQ(pilot_study(job, auto_candidates(job)).scenes.size(), 1u);
}

}  // namespace
}  // namespace baton
