#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "common/store/blob_store.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {

/// What people are told of a job.
JobSummary summarize(const Digest& digest, const Scheduler::Job& job);
/// Of a job that the scheduler knows. `failures`: the newest last.
JobDetail describe_job(const Scheduler& scheduler, const Digest& digest,
                       const std::vector<Failure>& failures);

/// The job of this digest, or the one of this name, or else the one whose digest starts so. Errors:
/// none, or several, whose digests it lists.
Result<Digest> resolve_job(const Scheduler& scheduler, const std::string& text);

/// The assemble tasks of `rival` whose frames a job would write over: those that are done, or of an
/// open job all.
std::vector<TaskKey> replaced_frames(const Scheduler::Job& rival, const JobSpec& job);

/// What is not there of the files that a job's recorded completions promise: blobs that are still
/// needed, and finished frames. Sizes are compared, contents are not read.
struct LostFiles {
  std::vector<TaskKey> tasks;             ///< that made them
  std::vector<TaskKey> spares;            ///< that made older checkpoints, which nobody needs now
  std::string first;                      ///< one of the files
  std::optional<std::string> unreadable;  ///< why it cannot be told now, of a file or folder
};
LostFiles find_lost_files(const JobAdded& job, const BlobStore& store);

}  // namespace baton
