#pragma once

#include "common/job/job_spec.h"

namespace baton {

/// What each population of a job draws: its share of particles and candidates.
SamplingSpec population_spec(const JobSpec& job);

/// The seed of a stream of random numbers that shares none with other streams; stream 0 is the
/// job's own.
std::uint64_t stream_seed(std::uint64_t job_seed, std::uint32_t stream);

/// Factor of population k's contributions in the image of the first pass: 1, but where one half
/// only decides.
float image_scale(const JobSpec& job, std::int32_t population);

}  // namespace baton
