#include "worker/method/weighted/populations.h"

#include <algorithm>

#include "common/job/job_facts.h"
#include "common/math/philox.h"
#include "worker/sampling/folds.h"

namespace baton {

SamplingSpec population_spec(const JobSpec& job) {
  SamplingSpec spec = job.sampling;
  spec.num_particles /= num_populations(job);
  spec.num_candidates = std::max(spec.num_candidates / num_populations(job), spec.num_particles);
  spec.refresh_candidates =
      std::max(spec.refresh_candidates / num_populations(job), spec.num_particles);
  return spec;
}

std::uint64_t stream_seed(std::uint64_t job_seed, std::uint32_t stream) {
  if (stream == 0) return job_seed;
  const Philox4x32::Counter bits = Philox4x32::block({stream, 0, 0, 0}, job_seed);
  return std::uint64_t{bits[1]} << 32 | bits[0];
}

float image_scale(const JobSpec& job, std::int32_t population) {
  if (num_populations(job) == 1) return 1;
  float scale = 0;
  for (const Fold& fold : folds_of(job.visibility.mask)) {
    if (fold.giver_population == population) scale += fold.energy_scale;
  }
  return scale;
}

}  // namespace baton
