#pragma once

#include "common/job/job_spec.h"
#include "jobs/cli/local_farm.h"

namespace baton {

/// Replaces `"method": "auto"` by what a pilot on a local farm finds best, and tells on stderr what
/// it saw and why. The pilot works in `pilot` below the farm's work directory, which keeps its runs
/// for the next time. Another method is left alone.
Status settle_method(JobSpec& job, const FarmOptions& farm);

}  // namespace baton
