#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/job_id.h"
#include "coordinator/journal/journal.h"

namespace baton {

/// Which document is a version of which job, when what happened to that, and which frames of it are
/// locked. What it learns it puts into the journal.
class IdentityBook {
 public:
  static Result<IdentityBook> read(Journal& journal);

  /// An empty ID: the document is no version of any job.
  JobIdentity of(const Digest& document) const;
  /// Frames of a job that count as done, whatever is in their files; ascending. None where it is
  /// not known.
  std::vector<FrameNumber> locked(const JobId& job) const;
  JobLocks locks(const JobId& job) const;
  /// Those that have locked frames.
  std::vector<JobId> with_locks() const;
  /// The priority of a job whose document says `written`.
  std::int32_t priority(const JobId& job, std::int32_t written) const;
  bool is_newest(const Digest& document) const;
  /// Oldest first; none where the job is not known.
  std::vector<Digest> versions(const JobId& job) const;
  /// The versions that are not the newest of their job.
  std::vector<Digest> superseded() const;
  std::size_t num_jobs() const { return jobs_.size(); }

  /// The document is the job's newest version from now on.
  Status add_version(Journal& journal, const Digest& document, const JobId& job);
  /// Replaces the times of a job that is known.
  Status set_times(Journal& journal, const JobId& job, const JobTimes& times);
  /// The frames count as done from now on, or no longer. changed_ms: as in JobLocks.
  Status set_locked(Journal& journal, const JobId& job, const std::vector<FrameNumber>& frames,
                    bool is_locked, std::int64_t changed_ms);
  /// The job has this priority while its document says `written`.
  Status set_priority(Journal& journal, const JobId& job, const PriorityChange& priority);
  /// The job is forgotten here; the journal forgets it with its documents.
  void forget(const JobId& job);

 private:
  struct Job {
    JobTimes times;
    JobLocks locks;
    std::optional<PriorityChange> priority;
    std::map<std::int32_t, Digest> versions;
  };
  std::map<JobId, Job> jobs_;
  std::map<Digest, JobVersion> documents_;
};

}  // namespace baton
