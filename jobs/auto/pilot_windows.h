#pragma once

#include <span>
#include <vector>

#include "jobs/study/study_runner.h"

namespace baton {

/// The job with about 2,300 pixels an image at most, for some of its frames, to be measured:
/// without what is rendered before them.
JobSpec small_job(const JobSpec& job, std::vector<FrameNumber> frames);

/// The parts of a job that a pilot renders: small_job, at most twelve frames at its start and at
/// its end.
std::vector<JobSpec> pilot_windows(const JobSpec& job);

/// A window as the scene of a study, with its references. Its last two frames are measured: with
/// the history that a carried sample then has.
StudyScene pilot_scene(const JobSpec& window);

/// Squared error over squared mean radiance, the mean of the renderings; not below 0.
double relative_square(std::span<const RunRecord> runs, const std::vector<Reference>& references);

}  // namespace baton
