// Primary rays of the sites of a pixel, beside one ray after the other.
#include "worker/pass/site_rays.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/job/plan/sequence.h"
#include "common/math/low_discrepancy.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/render_tiled.h"
#include "worker/sampling/pixel_filter.h"

namespace baton {
namespace {

using SiteRaysOn = OnInstructionSet;

/// The ray of one site.
Ray witness(const JobSpec& job, const Camera& camera, std::int32_t round, std::int32_t x,
            std::int32_t y, std::int32_t num_sites, std::int32_t site) {
  const Rng rng = site_random(job, x, y);
  const bool own_sites = rounds_have_own_sites(job);
  const auto shift = sobol_2d(own_sites ? static_cast<std::uint32_t>(round) : 0);
  const auto bits = rng.bits(0, static_cast<std::uint32_t>(site / 2));
  const auto k = static_cast<std::size_t>(site % 2 * 2);
  const auto side = static_cast<int>(std::lround(std::sqrt(job.image.sites)));
  const auto cuts = static_cast<int>(std::lround(std::sqrt(num_sites / job.image.sites)));
  const int cell = site % job.image.sites, cut = site / job.image.sites;
  const float width = 1.0f / static_cast<float>(side * cuts);
  const auto at = filter_position(
      job.image.filter,
      {(static_cast<float>(cell % side * cuts + cut % cuts) + uniform_float(bits[k] ^ shift[0])) *
           width,
       (static_cast<float>(cell / side * cuts + cut / cuts) +
        uniform_float(bits[k + 1] ^ shift[1])) *
           width});
  const float px = static_cast<float>(x) + at[0], py = static_cast<float>(y) + at[1];
  if (!camera.has_lens()) return camera.ray(px, py);
  const auto lens = rng.bits(1, 0);
  const auto u = sobol_2d(static_cast<std::uint32_t>((own_sites ? round * num_sites : 0) + site));
  return camera.ray(px, py, {uniform_float(u[0] ^ lens[0]), uniform_float(u[1] ^ lens[1])});
}

// Bit by bit: whatever the filter, the camera, the round and how finely cells are cut.
TEST_P(SiteRaysOn, AreThoseOfOneSiteAfterTheOther) {
  for (const PixelFilter filter :
       {PixelFilter::box, PixelFilter::gaussian, PixelFilter::blackman_harris}) {
    for (const int coarse : {1, 4, 9, 16}) {
      for (const int camera_kind : {0, 1, 2}) {
        JobSpec job = test::sequence_job(1);
        job.sampling.method = Method::pool;
        job.quality.rounds = 4;
        job.image.filter = filter;
        job.image.sites = coarse;
        if (camera_kind == 1) job.camera.projection = Projection::orthographic;
        if (camera_kind == 2) job.camera.aperture = 0.1f;
        const Camera camera(job.camera, job.image.width, job.image.height);
        for (const std::int32_t round : {0, 3}) {
          SiteRays sites(job, camera, round);
          for (const std::int32_t num_sites : {coarse, 4 * coarse, coarse, 16 * coarse}) {
            std::vector<Ray> rays(1);
            sites.append(5, -2, num_sites, rays);
            ASSERT_EQ(rays.size(), static_cast<std::size_t>(num_sites + 1));
            for (std::int32_t i = 0; i < num_sites; ++i) {
              const Ray expected = witness(job, camera, round, 5, -2, num_sites, i);
              const Ray& ray = rays[static_cast<std::size_t>(i) + 1];
              ASSERT_EQ(ray.origin, expected.origin) << num_sites << ", " << i;
              ASSERT_EQ(ray.direction, expected.direction) << num_sites << ", " << i;
            }
          }
        }
      }
    }
  }
}

TEST_P(SiteRaysOn, OfALoneSiteMeetTheMiddle) {
  JobSpec job = test::sequence_job(1);
  job.image.sites = 1;
  const Camera camera(job.camera, job.image.width, job.image.height);
  std::vector<Ray> rays;
  SiteRays(job, camera, 0).append(3, 4, 1, rays);
  EXPECT_EQ(rays.front().direction, camera.ray(3.5f, 4.5f).direction);
}

// Where pixels carry samples, those belong to the sites.
TEST(SiteRays, AreNewInEachRoundWhereNothingBelongsToThem) {
  for (const Method method : {Method::pool, Method::sequential}) {
    JobSpec job = test::sequence_job(3);
    job.sampling.method = method;
    job.quality.rounds = 4;
    const Camera camera(job.camera, job.image.width, job.image.height);
    std::vector<Ray> rays;
    for (const std::int32_t round : {0, 2}) SiteRays(job, camera, round).append(3, 4, 4, rays);
    ASSERT_EQ(rays.size(), 8u);
    EXPECT_EQ(rays[0].direction == rays[4].direction, method == Method::sequential);
  }
}

INSTANTIATE_TEST_SUITE_P(All, SiteRaysOn, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

}  // namespace
}  // namespace baton
