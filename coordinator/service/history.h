#pragma once

#include <map>
#include <set>
#include <string>

#include "coordinator/journal/journal.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/eta_book.h"
#include "coordinator/service/identity_book.h"
#include "coordinator/service/recent_past.h"

namespace baton {

/// "3 finished tasks are done again, since ...".
std::string reopened_text(const RecordReopened& tasks);

/// Tells the journal what happens, once, in the transaction of what it tells. Jobs are named by the
/// digest of a version; one that is a version of no job is told of without a name.
class History {
 public:
  /// journal: outlives the history.
  explicit History(Journal& journal) : journal_(journal) {}
  /// Takes up who the journal's jobs are. What tasks and workers of an earlier coordinator have no
  /// end in the journal gets one: it was killed, and what goes on will say so.
  Status read();

  /// Who does what is told from now on: a key's name, or a worker's; empty: the coordinator itself,
  /// or somebody without a key.
  void set_actor(std::string actor) { actor_ = std::move(actor); }
  const IdentityBook& jobs() const { return jobs_; }
  const RecentPast& past() const { return past_; }
  const EtaBook& etas() const { return etas_; }
  /// Short, for people: the ID of the job, or the beginning of the digest where it has none.
  std::string name_of(const Digest& version) const;

  /// The document is the job's newest version, and runs, from now on.
  /// reason: of the submission; of a job that is known, what becomes another comes after it.
  /// is_told: as an event; else it only looks whether it ends as it was.
  Status submitted(const Digest& document, const JobId& job, const std::string& reason,
                   bool is_told = true);
  Status status_changed(const Digest& version, JobStatus status, const std::string& reason);
  Status deleted(const Digest& version);
  /// Frames of the job count as done from now on, or no longer. changed_ms: since when (JobLocks);
  /// why: what is said of that.
  Status locked(const Digest& version, const std::vector<FrameNumber>& frames, bool is_locked,
                std::int64_t changed_ms, const std::string& why = {});
  Status requeued(const Digest& version, const std::vector<FrameNumber>& frames);
  /// The job has another priority from now on. before: the one it had; why: what is said of that.
  Status prioritized(const Digest& version, std::int32_t before, const PriorityChange& priority,
                     const std::string& why = {});
  /// What was set of a job's priority counts no more.
  Status forget_priority(const Digest& version, std::int32_t written) {
    return jobs_.set_priority(journal_, jobs_.of(version).id, {written, written});
  }
  Status granted(const Scheduler::Job& job, const LeaseId& lease, const std::string& worker,
                 const std::string& reason = {});
  /// job: null: it is forgotten.
  Status lease_ended(const Scheduler::Job* job, const TellLeaseEnd& end);
  /// An earlier coordinator has seen tasks of this open job.
  Status take_up_times(const Digest& version, const Scheduler::Job& job);
  Status reopened(const RecordReopened& tasks);
  /// Of the coordinator or a worker.
  Status happened(FarmEventKind kind, const std::string& worker = {},
                  const std::string& reason = {});
  /// Forgets what is old.
  Status clean_up();

 private:
  Status tell(FarmEvent event);
  Status remember(std::uint64_t kinds);

  Journal& journal_;
  IdentityBook jobs_;
  RecentPast past_;
  EtaBook etas_;
  /// Of jobs that had ended and go on, of which nothing has been granted since.
  std::map<JobId, JobTimes> before_;
  /// Of before_: those that go on only to end as they were, of which nobody is told.
  std::set<JobId> quiet_;
  std::string actor_;
};

}  // namespace baton
