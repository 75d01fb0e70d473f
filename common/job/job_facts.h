#pragma once

#include <cstdint>
#include <string>

#include "common/job/job_spec.h"

namespace baton {

/// What follows from the settings of a job alone.

/// True when the method hands something from frame to frame and state.carry lets it.
bool carries_state(const JobSpec& job);
/// Whether pixels weigh the samples of their neighbours: `restir` with neighbours.
bool asks_neighbors(const SamplingSpec& sampling);
/// A material's setting as one of the whole image.
SamplingSpec as_sampling(const MaterialSampling& material);
/// Whether the noise of a job's frames is told: of pixels that draw all samples anew, and whose
/// light no second pass shares out. Films then have a plane of errors (common/image/noise.h).
bool tells_noise(const JobSpec& job);
/// Whether each pixel is drawn a second time, which tells its variance (the AOV): of a frame with
/// one round, by a method that tells none.
bool draws_twice(const JobSpec& job);
/// Whether films have a part of the picture that frames have not, channels indirect.*: the second
/// pass draws only the rest anew.
bool hides_indirect(const JobSpec& job);
/// Whether something catches shadows; films then have channels shadow.*.
bool has_catcher(const JobSpec& job);
/// The key that says so, the first of them: "scene.objects[2].catcher"; empty: none.
std::string catcher_key(const JobSpec& job);
/// Samples of a pixel: the most of any material.
std::int32_t most_particles(const SamplingSpec& sampling);
/// Particles per pixel in the job's states; 0 where rays are chosen apart from samples.
std::int32_t num_carried_particles(const SamplingSpec& sampling);

/// Whether pixels have more sites where geometry is fine.
inline bool has_fine_sites(const JobSpec& job) { return job.image.most_sites() > job.image.sites; }
/// Whether each round of a frame has sites of its own. Samples that are carried belong to a
/// surface: where pixels carry them, all rounds have the same sites.
bool rounds_have_own_sites(const JobSpec& job);
/// Rounds before the first step that are not seen: state.preroll, where pixels carry a memory.
std::int32_t num_preroll_rounds(const JobSpec& job);
/// Such a round has one pixel of each square of so many pixels a side: blocks learn together, and
/// these are enough to begin with.
inline constexpr std::int32_t kPrerollSide = 2;
/// Share of the pixels that it has.
inline constexpr double kPrerollShare = 1.0 / (kPrerollSide * kPrerollSide);

/// Sets of samples of a pixel that never exchange anything: 2 when one decides what is done with
/// the other, else 1.
std::int32_t num_populations(const JobSpec& job);
/// How far from a tile the second pass reads: pixels whose samples it exchanges, and whose rays
/// decide the mask.
std::int32_t exchange_reach_px(const VisibilitySpec& visibility);

}  // namespace baton
