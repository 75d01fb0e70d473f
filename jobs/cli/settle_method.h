#pragma once

#include "common/job/job_spec.h"
#include "jobs/auto/auto_pilot.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/local_farm.h"

namespace baton {

/// Replaces `"method": "auto"` by what a pilot on a local farm finds best, and tells on stderr what
/// it does, what it saw and why. The pilot works in `pilot` below the farm's work directory, which
/// keeps its runs for the next time. Another method is left alone.
Status settle_method(JobSpec& job, const FarmOptions& farm);

/// The same on the workers of a coordinator that runs already; the pilot's frames are written to
/// .baton/pilot in the job's output folder, which the workers share.
Status settle_method_at(JobSpec& job, const CoordinatorLink& coordinator);

/// "up to 9 candidates, 360 frames of 2304 pixels, about 20 s of CPU time".
std::string pilot_text(const PilotPlan& plan);

}  // namespace baton
