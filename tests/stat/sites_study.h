#pragma once

#include <algorithm>
#include <functional>

#include "tests/stat/against_brute_force.h"

namespace baton::test {

/// How much of the study is done: seeds of each picture, and rounds of each seed.
struct StudySize {
  int runs, rounds;
};

/// A method with so many sites beside brute force.
struct StudyRow {
  Method method;
  int sites;        ///< 64: up to 64, where geometry is fine
  double bias = 0;  ///< of the mean of the picture, relative
  Verdict verdict{};
};

/// The last of two frames under a map that turns, of three where camera and an object move too.
inline JobSpec studied_job(bool in_motion) {
  JobSpec job = box_job();
  job.frames = frame_numbers(in_motion ? 3 : 2);
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.num_candidates = 64;
  if (in_motion) set_in_motion(job, true, true);
  return job;
}

/// The mean over the sites of a pixel does not depend on their number. in_middle: of one site in
/// its middle, which samples that are carried have.
inline Estimate brute_force(bool in_motion, bool in_middle, const StudySize& size) {
  constexpr int kSites = 16, kRounds = 4;
  JobSpec job = studied_job(in_motion);
  keep_last_frame(job);
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = 64 * size.rounds / (in_middle ? 1 : kRounds);
  job.image.sites = in_middle ? 1 : kSites;
  job.quality.rounds = in_middle ? 1 : kRounds;
  return repeat(job, size.runs);
}

/// Every method with 1, 4, 16 and up to 64 sites. `brdf` is left out, as its rare samples of the
/// sun have no normal distribution, and `ratio`, which has a bias.
inline void study_sites(bool in_motion, const StudySize& size,
                        const std::function<void(const StudyRow&)>& see) {
  const Estimate of_area = brute_force(in_motion, false, size);
  const Estimate of_middle = brute_force(in_motion, true, size);
  for (const Method method : {Method::environment, Method::mis, Method::bidirectional, Method::pool,
                              Method::sequential, Method::restir}) {
    JobSpec job = studied_job(in_motion);
    job.sampling.method = method;
    job.sampling.num_particles = method == Method::environment || method == Method::mis ? 64 : 16;
    job.quality.rounds = size.rounds;
    for (const int sites : {1, 4, 16, 64}) {
      if (sites == 64 && !rounds_have_own_sites(job)) continue;
      job.image.sites = std::min(sites, 16);
      job.image.max_sites = sites == 64 ? 64 : 0;
      const Estimate& truth = sites == 1 && !rounds_have_own_sites(job) ? of_middle : of_area;
      const Estimate found = repeat(job, size.runs);
      see({method, sites, found.image_mean / truth.image_mean - 1, compare(found, truth)});
    }
  }
}

}  // namespace baton::test
