#pragma once

#include <vector>

#include "jobs/auto/auto_choice.h"
#include "jobs/study/study_runner.h"

namespace baton {

/// What settle_auto is going to do.
struct PilotPlan {
  std::size_t candidates = 0, windows = 0;
  std::int64_t pixels = 0;  ///< in a small frame
  /// All frames, if half of the candidates are measured again.
  std::size_t frames = 0;
  double cpu_seconds = 0;  ///< as much, of counted work
};
/// job: with `auto`. ray_factor: ray_cost_factor of the job.
PilotPlan plan_pilot(const JobSpec& job, double ray_factor);

/// Settles `"method": "auto"`: renders the job small (about 2300 pixels, at most twelve frames at
/// its start and at its end) with every candidate and a few seeds, those near the best with more,
/// judges them by error and counted work, and writes the choice with its reasons into the job. A
/// job with another method is left as it is. Deterministic given the job and its assets; finished
/// renderings are kept in `folder`. Returns the numbers seen, empty for another method.
Result<std::vector<PilotNumbers>> settle_auto(JobSpec& job, const StudyFolder& folder,
                                              JobRunner& runner);

/// Settles every cell of a study whose method is `auto`, so that the choice is charted against
/// fixed ones. The cost of the pilots is not part of the cells'.
Status settle_study(Study& study, const StudyFolder& folder, JobRunner& runner);

/// The study that the pilot renders: scenes are windows of frames, cells the candidates in their
/// order. Seeds are the caller's.
Study pilot_study(const JobSpec& job, const std::vector<AutoCandidate>& candidates);

}  // namespace baton
