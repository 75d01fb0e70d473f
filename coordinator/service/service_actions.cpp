#include <spdlog/spdlog.h>

#include "common/store/folder_token.h"
#include "coordinator/service/diagnostics_file.h"
#include "coordinator/service/service.h"

// What the scheduler decides, carried out: journalled, sent or noted for the end of the turn.

namespace baton {
namespace {

namespace fs = std::filesystem;

/// After which a worker that got less than it requested may ask again.
constexpr std::int32_t kRetryMs = 250;

}  // namespace

Status Service::perform(const RecordCompletion& action) {
  return journal_.record_completion(action.job, action.completion);
}

Status Service::perform(const RecordOutputs& action) {
  return journal_.record_outputs(action.job, action.task, action.outputs);
}

Status Service::perform(const RecordFailure& action) {
  const Failure& failure = action.failure;
  spdlog::warn("job {}: attempt {} on {} failed: {}", failure.lease.job.short_hex(),
               failure.lease.attempt, failure.worker, failure.message);
  return journal_.record_failure(failure);
}

Status Service::perform(const RecordReopened& action) {
  spdlog::warn("job {}: {} finished tasks are done again, since {} is gone", action.job.short_hex(),
               action.tasks.size(), action.gone);
  return journal_.record_reopened(action.job, action.tasks);
}

Status Service::perform(const RecordJobStatus& action) {
  const auto level = action.status == JobStatus::failed ? spdlog::level::err : spdlog::level::info;
  spdlog::log(level, "job {}: {}", action.job.short_hex(), action.reason);
  // Before the status is durable: whoever is killed in between ends the job, and writes, again.
  const Scheduler::Job* job = scheduler_.find_job(action.job);
  if (job != nullptr && !is_open(action.status) && check_output_root(job->spec, options_.roots)) {
    const Status written = write_diagnostics(journal_, action.job, job->spec);
    if (!written) spdlog::warn("no diagnostics: {}", written.error().message);
  }
  remove_job_file(action.job, action.status);
  if (job != nullptr && !is_open(action.status)) {
    std::error_code error;  // where it cannot be removed, it could not be written
    fs::remove(output_token_file(job->spec.output.directory, action.job), error);
  }
  if (!is_open(action.status)) ended_.push_back(action.job);
  return journal_.record_status(action.job, action.status);
}

Status Service::perform(const GrantLease& action) {
  const Grant& grant = action;
  return reply_to(action.worker, grant);
}

Status Service::perform(const AskForStates& action) {
  return reply_to(action.worker, RequestStates{action.job, action.states});
}

Status Service::perform(const RevokeLease& action) {
  return reply_to(action.worker, LeaseRevoke{action.lease});
}

Status Service::perform(const ReportNoWork& action) {
  return reply_to(action.worker, NoWork{kRetryMs});
}

Status Service::perform(const ForgetWorker& action) {
  spdlog::warn("worker {} is silent: its leases go to others", action.worker);
  peers_.remove(action.worker);
  return {};
}

Status Service::perform(const ReportConflict& action) {
  spdlog::error(
      "BUG: job {}: {}: worker {} reports {} for frame index {}, tile {}, but worker {} has "
      "reported {}",
      action.lease.job.short_hex(), describe_task(action.lease.task), action.worker,
      action.reported.digest.hex(), action.reported.position, action.reported.tile, action.maker,
      action.expected.digest.hex());
  return {};
}

Status Service::perform(const RemoveBlobs& action) {
  garbage_.insert(garbage_.end(), action.blobs.begin(), action.blobs.end());
  return {};
}

/// Marks the output folder of an open job, for workers. Returns the token; empty: it cannot be
/// marked, or the job has ended.
std::string Service::mark_output(const Digest& job) const {
  const Scheduler::Job* const open = scheduler_.find_job(job);
  if (open == nullptr || !is_open(open->status)) return {};
  if (!check_output_root(open->spec, options_.roots)) return {};
  const fs::path file = output_token_file(open->spec.output.directory, job);
  return write_token(file, token_) ? token_ : std::string();
}

/// The document for replays outlives its job only if that has failed.
void Service::remove_job_file(const Digest& job, JobStatus status) {
  if (status != JobStatus::done && status != JobStatus::cancelled) return;
  std::error_code error;
  fs::remove(store_.job_file(job), error);
  if (error) spdlog::warn("{}: cannot remove: {}", store_.job_file(job).string(), error.message());
}

}  // namespace baton
