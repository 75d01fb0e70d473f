#pragma once

#include <span>
#include <vector>

#include "jobs/study/study_runner.h"

namespace baton {

/// The parts of a job that a pilot renders: small (about 2300 pixels), at most twelve frames at its
/// start and at its end.
std::vector<JobSpec> pilot_windows(const JobSpec& job);

/// A window as the scene of a study, with its references. Its last two frames are measured: with
/// the history that a carried sample then has.
StudyScene pilot_scene(const JobSpec& window);

/// Squared error over squared mean radiance, the mean of the renderings; not below 0.
double relative_square(std::span<const RunRecord> runs, const std::vector<Reference>& references);

}  // namespace baton
