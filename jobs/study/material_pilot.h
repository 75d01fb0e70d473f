#pragma once

#include "jobs/study/auto_choice.h"
#include "jobs/study/study_runner.h"

namespace baton {

/// Looks whether settings by material (SamplingSpec::by_material) do better than `choice`, the best
/// one for all alike: every method that draws its samples anew, at several N, is judged material by
/// material on some seeds; what comes of it is rendered with other seeds beside the one for all,
/// and taken when it gains 5 % there. Leaves `choice` as it is otherwise, and says why.
/// Deterministic given the job and its assets.
Status vary_by_material(const JobSpec& job, double lit_pixels, const StudyFolder& folder,
                        JobRunner& runner, AutoChoice& choice);

}  // namespace baton
