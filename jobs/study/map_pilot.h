#pragma once

#include "jobs/study/auto_choice.h"
#include "jobs/study/study_runner.h"

namespace baton {

/// The pixels of a job with a surface, times its frames, and their share of all.
struct LitPixels {
  double total = 0;
  double share = 0;
};

/// Looks whether coarser maps do as well for `choice` (EnvironmentSpec::max_width). The coarsest
/// one is sought whose pictures differ from those under the maps as they are by so little that the
/// expected error hides it (judge_map), at up to twelve frames over the whole job; it is taken when
/// 1 / (error^2 x cost), the frames' light counted, then gains 5 % on seeds that chose nothing.
/// Never where the picture may show the map itself. Leaves the maps as they are otherwise, and says
/// why. Deterministic given the job and its assets.
Status coarsen_maps(const JobSpec& job, LitPixels lit, const StudyFolder& folder, JobRunner& runner,
                    AutoChoice& choice);

/// The frames at which maps are compared: at most twelve, evenly spread, the first and the last
/// among them.
std::vector<int> compared_frames(const std::vector<int>& frames);

}  // namespace baton
