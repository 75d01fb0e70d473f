#pragma once

#include <cstdint>

#include "common/job/farm_event.h"
#include "common/job/job_spec.h"
#include "common/job/plan/timeline.h"
#include "common/job/task.h"

namespace baton {

/// Which frames a task of the job works on; timeline: the job's.
TaskPlace place_of(const JobSpec& job, const Timeline& timeline, const TaskKey& task,
                   std::uint32_t attempt = 0);
/// For those who do not know the job's runs (JobPlan): steps: of a task that renders.
TaskPlace place_of(const JobSpec& job, const Timeline& timeline, const TaskKey& task,
                   const StepSpan& steps, std::uint32_t attempt = 0);

}  // namespace baton
