#include "jobs/auto/unit_costs.h"

#include <gtest/gtest.h>

#include <cmath>

namespace baton {
namespace {

TEST(RayCostFactor, GrowsWithTheSceneAndWhereObjectsMove) {
  EXPECT_EQ(ray_cost_factor(75'000, false), 1);
  EXPECT_NEAR(ray_cost_factor(150'000, false), std::exp2(0.14), 1e-12);
  EXPECT_LT(ray_cost_factor(2, false), 0.3);
  EXPECT_EQ(ray_cost_factor(5'000, true), 3 * ray_cost_factor(5'000, false));
  EXPECT_GT(ray_cost_factor(0, false), 0);
}

TEST(RayCostFactor, OfAJobIsThatOfItsTriangles) {
  JobSpec job;
  job.scene.materials["grey"] = {};
  job.scene.ground = GroundSpec{};
  job.scene.ground->material = "grey";
  const Result<double> factor = ray_cost_factor(job);
  ASSERT_TRUE(factor.ok()) << factor.error().message;
  EXPECT_EQ(*factor, ray_cost_factor(2, false));

  job.scene.meshes["gone"].path = "/none/gone.obj";
  job.scene.objects.push_back({});
  job.scene.objects.back().mesh = "gone";
  job.scene.objects.back().material = "grey";
  EXPECT_FALSE(ray_cost_factor(job));
}

TEST(CountedCost, OnlyRaysFollowTheScene) {
  JobSpec job;
  job.sampling.method = Method::pool;
  const RunCounts pixels{.pixels = 300, .pixels_background = 100, .target_evaluations = 5000};
  EXPECT_EQ(counted_cost_us(job, 3, pixels), counted_cost_us(job, 1, pixels));
  EXPECT_GT(counted_cost_us(job, 1, pixels), 0);

  const RunCounts rays{.rays_shadow = 1000};
  EXPECT_GT(counted_cost_us(job, 1, rays), 0);
  EXPECT_DOUBLE_EQ(counted_cost_us(job, 3, rays), 3 * counted_cost_us(job, 1, rays));
}

}  // namespace
}  // namespace baton
