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
/// `failures`: the newest last.
JobDetail describe_job(const Digest& digest, const Scheduler::Job& job,
                       const std::vector<Failure>& failures);

/// The one job whose digest starts with the hexadecimal `prefix`. Errors: none, or more than one.
Result<Digest> resolve_job(const Scheduler& scheduler, const std::string& prefix);

/// The first file that the job's recorded completions promise and that is not there: a blob that is
/// still needed, or a finished frame. nullopt: everything is in its place.
std::optional<std::string> find_missing_file(const JobAdded& job, const BlobStore& store);

}  // namespace baton
