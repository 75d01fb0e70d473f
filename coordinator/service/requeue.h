#pragma once

#include <optional>
#include <set>
#include <vector>

#include "common/protocol/messages.h"
#include "coordinator/journal/journal.h"
#include "coordinator/schedule/job_graph.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/locked_frames.h"

namespace baton {

/// Frames that are there are rendered once more, because somebody wants it.

/// Their places. Errors: places_of()'s; usage, some are locked.
Result<std::set<FrameIndex>> frames_to_requeue(const JobSpec& spec,
                                               const std::vector<FrameNumber>& frames,
                                               const LockedFrames& locked);
/// All tasks that make these frames: assemblies, second passes, and the tiles of their runs in all
/// sweeps.
std::vector<TaskKey> tasks_of_frames(const JobGraph& graph, const std::set<FrameIndex>& frames);
/// What would be done for these frames, as far back as the states that are there reach, and what
/// that costs by what the job's pixels have taken so far. known: what is recorded as done; lost:
/// what is gone of that. ended: as what a job has ended that goes on with all that is left of it;
/// nullopt: it is open. The identity is left empty.
RequeuePlan plan_requeue(const JobSpec& spec, const JournalledJob& known, const LostFiles& lost,
                         const std::set<FrameIndex>& frames, std::optional<JobStatus> ended);

}  // namespace baton
