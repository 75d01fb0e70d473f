#pragma once

#include "coordinator/service/farm_core.h"

namespace baton {

/// Keeps the locks of frames the same in the journal, the scheduler and the output folders.
class LockKeeper {
 public:
  explicit LockKeeper(FarmCore& farm) : farm_(farm) {}

  /// Before anything is decided by the locks of a job's output folder: makes one of what it and the
  /// journal say (settle_locks). Frames of open jobs that only the folder knew to be locked count
  /// as done; of one that a worker is writing it asks before that gets its name.
  Status settle(const JobSpec& spec);
  /// The locked frames of an open job count as done.
  Status leave_frames(const Digest& version);
  /// Says in the output folder which frames of the job are locked (tell_locks).
  Status tell(const JobSpec& spec, const JobId& id, const JobLocks& locks);
  /// The same of what is locked now; where it cannot, that is logged (tell_locks_again).
  Status tell_again(const JobSpec& spec, const JobId& id);

 private:
  FarmCore& farm_;
};

}  // namespace baton
