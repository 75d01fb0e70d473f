#pragma once

#include <span>
#include <vector>

#include "jobs/study/study_runner.h"

namespace baton {

/// Seeds of pilots: by the first ones settings are chosen, by those after them a choice by material
/// is judged, by the last ones a coarser map.
inline constexpr int kChoosingSeeds = 12;
inline constexpr int kJudgingSeeds = 24;
inline constexpr int kFirstMapSeed = kChoosingSeeds + kJudgingSeeds + 1;

/// The parts of a job that a pilot renders: small (about 2300 pixels), at most twelve frames at its
/// start and at its end.
std::vector<JobSpec> pilot_windows(const JobSpec& job);

/// The last two frames of a window, which are measured: with the history that a carried sample then
/// has.
std::vector<int> measured_frames(const JobSpec& window);

/// Leaves out of a study's cells the frames that are not measured: for samples that nothing
/// carries.
void keep_measured_frames(Study& study);

/// A window as the scene of a study, with its references; they tell materials, so that errors are
/// known by material (Reference::block).
StudyScene pilot_scene(const JobSpec& window);

/// The job as small as `num_pixels` a picture, at most its own, for some of its frames.
JobSpec small_job(const JobSpec& job, std::vector<int> frames, double num_pixels);

/// Squared error over squared mean radiance, the mean of the runs; not below 0.
double relative_square(std::span<const RunRecord> runs, const std::vector<Reference>& references);

}  // namespace baton
