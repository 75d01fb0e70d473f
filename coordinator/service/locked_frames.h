#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_id.h"
#include "common/job/job_spec.h"
#include "common/job/text/roots.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/history.h"

namespace baton {

/// The frames of one document that are locked: they count as done, and what is in their files is
/// neither read nor replaced. The files must be there.
class LockedFrames {
 public:
  LockedFrames() = default;
  /// numbers: IdentityBook::locked; those that the document does not have are left out.
  LockedFrames(const JobSpec& spec, const std::vector<FrameNumber>& numbers);

  bool contains(FrameIndex frame) const { return frames_.contains(frame); }
  const std::set<FrameIndex>& frames() const { return frames_; }
  /// Ascending by place.
  std::vector<FrameNumber> numbers(const JobSpec& spec) const;

 private:
  std::set<FrameIndex> frames_;
};

/// For people: which frames stay as they are; empty: none are locked.
std::string locked_text(const JobSpec& spec, const LockedFrames& locked);

/// The places of frames in a document. Error (bad_input): it does not have them all.
Result<std::vector<FrameIndex>> places_of(const JobSpec& spec,
                                          const std::vector<FrameNumber>& frames);
/// The places of frames that are to be locked. job: of this document; null: it has ended. Errors:
/// places_of()'s; bad_input, a file is not there; timeout, a worker is writing one now; those of
/// stamp_of().
Result<std::vector<FrameIndex>> frames_to_lock(const JobSpec& spec,
                                               const std::vector<FrameNumber>& frames,
                                               const Scheduler::Job* job);
/// Names of the files of frames, in the job's folder.
std::set<std::string> frame_files(const JobSpec& spec, const std::vector<FrameNumber>& frames);
/// Writes into a job's output folder, for other coordinators, that these of its frames are locked,
/// under the names that they have in any of its versions, and takes those off that stand in folders
/// to which its name led before and are no more. Errors, io: that cannot be written; and the
/// journal's.
Status tell_locks(Journal& journal, const JobSpec& spec, const std::vector<Digest>& versions,
                  const JobId& id, const JobLocks& locks, const Roots& roots);
/// The same of what is locked now; where it cannot be written, that is logged, and others do not
/// learn of it before it is said again. Errors: the journal's.
Status tell_locks_again(Journal& journal, const JobSpec& spec, const IdentityBook& jobs,
                        const JobId& id, const Roots& roots);
/// When the locks of a job change that do so now.
std::int64_t lock_time_ms(const IdentityBook& jobs, const JobId& id);
/// Makes one of what the job's output folder and the journal say of the locks of jobs that are
/// known. The folder may have been away when frames were unlocked, or have had another name when
/// they were locked: those are taken off it. What is newer in the folder than in the journal, which
/// was then put back from a copy, stays locked; returned are the frames of which the journal did
/// not know. Errors: the journal's.
Result<std::map<JobId, std::vector<FrameNumber>>> settle_locks(Journal& journal, History& history,
                                                               const JobSpec& spec,
                                                               const Roots& roots);
/// Why a job is refused that would replace frames that are locked in another one. other_name:
/// short, of that job. there: how they are numbered in it, where names of files meet.
Error locked_elsewhere(const JobSpec& job, const std::vector<FrameNumber>& frames,
                       const std::string& other_name, const std::vector<FrameNumber>& there);
/// By what stands in the folder. Errors: bad_input, another job has locked frames of this one, or
/// this one has under other numbers; io, it cannot be read.
Status expect_no_strange_locks(const JobSpec& spec, const IdentityBook& jobs, const JobId& id);
/// Error (bad_input): some of these frames are not among those that are locked in the job.
Status expect_locked(const JobId& job, const std::vector<FrameNumber>& locked,
                     const std::vector<FrameNumber>& frames);

}  // namespace baton
