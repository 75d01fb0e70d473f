#pragma once

#include <array>

#include "common/base/limits.h"
#include "common/state/sample_state.h"
#include "worker/method/pixel_method.h"

namespace baton {

/// What each population of a job draws: its share of particles and candidates.
SamplingSpec population_spec(const JobSpec& job);

/// The seed of a stream of random numbers that shares none with other streams; stream 0 is the
/// job's own.
std::uint64_t stream_seed(std::uint64_t job_seed, std::uint32_t stream);

/// (f cos L)_rgb at the samples of one pixel.
struct SampleColors {
  std::array<float, limits::kMaxParticles> r, g, b;
};

/// Calls the sampler once for each population of pixel `index` of the state; they share nothing but
/// the frame's presampled light. num_particles: of all populations; the rest of the pixel's row in
/// the state is left alone. The answer counts all of them; its ess is the sum.
PixelDiagnostics sample_populations(const PixelSampler& sampler, std::size_t num_particles,
                                    const PixelInput& input, std::size_t index,
                                    SamplerScratch& scratch, SampleState& state,
                                    SampleColors& colors);

/// What a pixel's populations say together.
float mean_lns(const SampleState& state, std::size_t index);
PixelSource latest_source(const SampleState& state, std::size_t index);

/// u_j / K = unit_contribution * weight_j of a particle of population k: the contributions of all
/// particles of a pixel together estimate its Lns.
inline float unit_contribution(const SampleState& state, std::size_t index, std::size_t k) {
  return state.lns[index * static_cast<std::size_t>(state.num_populations) + k] /
         static_cast<float>(state.num_populations);
}

/// What the pixel carries is of a shadow catcher.
void set_catcher(SampleState& state, std::size_t index);
/// Makes pixel `index` one that sees nothing.
void set_background(SampleState& state, std::size_t index);

}  // namespace baton
