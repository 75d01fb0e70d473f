#pragma once

#include <optional>
#include <string>
#include <vector>

#include "coordinator/schedule/reasons.h"
#include "coordinator/service/farm_core.h"

namespace baton {

/// What people are told when they ask what a farm does, and why. Made for one question.
class Answers {
 public:
  /// farm: outlives the answers, and does not change meanwhile.
  explicit Answers(const FarmCore& farm);

  /// What a version of a job does; one that the scheduler does not have has ended.
  JobNow now_of(const Digest& version, JobStatus status) const;
  /// Workers with what they do, those that were lost, and what they might do.
  JobList list_workers() const;
  /// Why the job, or the frame or tile of it that is asked for, is not done. Errors, bad_input: it
  /// has no such frame or tile.
  Result<ReasonChain> why_job(const Digest& version, JobStatus status,
                              const AskWhy& question) const;
  /// Errors, bad_input: no worker of this name was connected of late.
  Result<ReasonChain> why_worker(const std::string& worker) const;
  /// The tasks of a job that workers have now.
  std::vector<ListedTask> tasks_in_hand(const Digest& version) const;

 private:
  Result<std::vector<Cause>> causes_of(const Digest& version, const AskWhy& question) const;
  Eta eta_of(const Digest& version) const;
  Reason reason_of(const Cause& cause) const;
  WorkerSummary describe(WorkerSummary worker) const;
  Reason end_reason(const Digest& version, JobStatus status) const;
  std::string text_of(const Cause& cause) const;
  std::string pause_text(const Digest& version, const std::string& waits) const;
  std::string paused_text(const std::vector<Digest>& jobs) const;
  std::string turned_away_text() const;
  std::string busy_text(const Cause& cause) const;
  std::string store_text(const Cause& cause, const std::string& place) const;
  std::string place(const Cause& cause) const;
  JobId id_of(const Digest& version) const { return farm_.history.jobs().of(version).id; }

  const FarmCore& farm_;
  const TimePoint now_;
  const Reasons reasons_;
};

}  // namespace baton
