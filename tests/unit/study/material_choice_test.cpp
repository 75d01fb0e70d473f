#include "jobs/study/material_choice.h"

#include <gtest/gtest.h>

#include <cmath>

namespace baton {
namespace {

/// A matte material on half the pixels, which cheap samples serve well, and a glossy one.
const std::vector<SeenMaterial> kMaterials{{"gloss", 0.5}, {"matte", 0.5}};

MaterialNumbers numbers(const std::string& family, Method method, int n, double gloss, double matte,
                        double cost_us) {
  MaterialNumbers result{{family, {}, false}, {gloss, matte}, cost_us};
  result.candidate.sampling.method = method;
  result.candidate.sampling.num_particles = n;
  return result;
}

JobSpec automatic_job(int n) {
  JobSpec job;
  job.sampling.method = Method::automatic;
  job.sampling.num_particles = n;
  return job;
}

TEST(MaterialChoice, EachMaterialTakesWhatServesIt) {
  const std::vector<MaterialNumbers> pilot{numbers("cheap", Method::environment, 16, 100, 1, 1),
                                           numbers("dear", Method::bidirectional, 16, 1, 1, 3)};
  const auto choice =
      choose_by_material(automatic_job(16), kMaterials, pilot, pilot[1].candidate.sampling, 1);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->sampling[0].method, Method::bidirectional);
  EXPECT_EQ(choice->sampling[1].method, Method::environment);
  EXPECT_NEAR(choice->error, std::sqrt(2), 1e-9);
  EXPECT_NEAR(choice->cost_us, 2, 1e-9);
  EXPECT_EQ(choice->name(kMaterials), "gloss bidirectional N=16 M=128 + matte environment N=16");
}

TEST(MaterialChoice, NoneDepartsForLessThanFivePercent) {
  const auto departs = [](double matte_error) {
    const std::vector<MaterialNumbers> pilot{
        numbers("a", Method::environment, 16, 100, matte_error, 3),
        numbers("b", Method::bidirectional, 16, 1, 1, 3)};
    return choose_by_material(automatic_job(16), kMaterials, pilot, pilot[1].candidate.sampling, 1)
        .has_value();
  };
  EXPECT_FALSE(departs(0.92));  // the picture gains 2 / 1.92 = 4.2 %
  EXPECT_TRUE(departs(0.88));   // 6.4 %
}

// Noise of variance v / N at a cost of N: with v = 16 : 1 the best N are as 4 : 1, and more rays in
// the mean than were asked for are not to be had.
TEST(MaterialChoice, MovesRaysToWhereTheNoiseIs) {
  std::vector<MaterialNumbers> pilot;
  for (const int n : {8, 16, 32})
    pilot.push_back(numbers("a", Method::bidirectional, n, 16.0 / n, 1.0 / n, n));
  const auto choice =
      choose_by_material(automatic_job(16), kMaterials, pilot, pilot[1].candidate.sampling, 1);
  ASSERT_TRUE(choice);
  // (16 / 16 + 1 / 8) x 12 = 13.5, (16 / 32 + 1 / 8) x 20 = 12.5 needs 20 rays; alike 17.
  EXPECT_EQ(choice->sampling[0].num_particles, 16);
  EXPECT_EQ(choice->sampling[1].num_particles, 8);
}

TEST(MaterialChoice, ReachesTheTargetErrorForLess) {
  JobSpec job = automatic_job(16);
  job.sampling.target_error = 0.5f;
  std::vector<MaterialNumbers> pilot;
  for (const int n : material_particles(job.sampling))
    pilot.push_back(numbers("a", Method::bidirectional, n, 1.6 / n, 0.1 / n, n));
  SamplingSpec base = pilot[0].candidate.sampling;
  base.num_particles = 8;  // 1.7 / 8 <= .25, alike for all
  const auto choice = choose_by_material(job, kMaterials, pilot, base, 1);
  ASSERT_TRUE(choice);
  EXPECT_LE(choice->error, 0.5);
  EXPECT_LT(choice->cost_us, 8 / 1.05);
  EXPECT_GT(choice->sampling[0].num_particles, choice->sampling[1].num_particles);
}

TEST(MaterialChoice, TriesHalfAndTwiceTheRays) {
  EXPECT_EQ(material_particles(automatic_job(16).sampling), (std::vector<int>{8, 16, 32}));
  EXPECT_EQ(material_particles(automatic_job(1).sampling), (std::vector<int>{1, 2}));
  EXPECT_EQ(material_particles(automatic_job(64).sampling), (std::vector<int>{32, 64}));
}

}  // namespace
}  // namespace baton
