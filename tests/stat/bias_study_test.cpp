// Every method with 1, 4, 16 and 64 sites, at rest and in motion: 200 runs beside brute force, with
// as many rounds as show a bias of 0.1 %. It takes half an hour, so it is run by hand:
//   stat_tests --gtest_also_run_disabled_tests --gtest_filter='*BiasStudy*'
// Level 1e-3 for each comparison's mean of the picture and for the worst of its pixels.
#include <gtest/gtest.h>

#include "tests/stat/against_brute_force.h"

namespace baton {
namespace {

using test::Estimate;

constexpr int kRuns = 200;

struct Studied {
  Method method;
  int num_particles, rounds;
};

JobSpec studied_job(bool in_motion) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(in_motion ? 3 : 2);
  job.environment.rotation_deg_per_frame = 0.3;
  if (in_motion) test::set_in_motion(job, true, true);
  return job;
}

/// The mean over the sites of a pixel does not depend on their number. in_middle: of one site in
/// its middle, which samples that are carried have.
Estimate brute_force(bool in_motion, bool in_middle) {
  JobSpec job = studied_job(in_motion);
  test::keep_last_frame(job);
  job.sampling.method = Method::reference;
  job.image.sites = in_middle ? 1 : 16;
  job.quality.rounds = in_middle ? 1 : 16;
  job.sampling.reference_samples = in_middle ? 4096 : 256;
  return test::repeat(job, kRuns);
}

void study(bool in_motion) {
  const Estimate of_area = brute_force(in_motion, false), of_middle = brute_force(in_motion, true);
  for (const Studied& studied : {Studied{Method::environment, 64, 64},
                                 {Method::mis, 64, 64},
                                 {Method::bidirectional, 16, 64},
                                 {Method::pool, 16, 32},
                                 {Method::sequential, 16, 64},
                                 {Method::restir, 16, 64}}) {
    JobSpec job = studied_job(in_motion);
    job.sampling.method = studied.method;
    job.sampling.num_particles = studied.num_particles;
    job.sampling.num_candidates = 64;
    job.quality.rounds = studied.rounds;
    for (const int sites : {1, 4, 16, 64}) {
      if (sites == 64 && !rounds_have_own_sites(job)) continue;
      job.image.sites = std::min(sites, 16);
      job.image.max_sites = sites == 64 ? 64 : 0;
      const Estimate& truth = sites == 1 && !rounds_have_own_sites(job) ? of_middle : of_area;
      const Estimate found = test::repeat(job, kRuns);
      const test::Verdict v = test::compare(found, truth);
      std::printf("  %-14s %2d sites: %+.3f %%, |z| %.2f, worst pixel |z| %.2f, resolves %.2f %%\n",
                  std::string(traits(studied.method).name).c_str(), sites,
                  100 * (found.image_mean / truth.image_mean - 1), v.image, v.worst_pixel,
                  100 * v.resolution);
      std::fflush(stdout);
      EXPECT_LT(v.worst_pixel, test::kPixelLimit);
      EXPECT_LT(v.image, test::kImageLimit);
    }
  }
}

TEST(BiasStudy, DISABLED_AtRest) { study(false); }
TEST(BiasStudy, DISABLED_InMotion) { study(true); }

}  // namespace
}  // namespace baton
