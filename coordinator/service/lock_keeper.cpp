#include "coordinator/service/lock_keeper.h"

namespace baton {

Status LockKeeper::settle(const JobSpec& spec) {
  BATON_ASSIGN(const auto taken_up,
               settle_locks(farm_.journal, farm_.history, spec, farm_.options.roots));
  for (const auto& [id, frames] : taken_up)
    BATON_TRY(leave_frames(farm_.history.jobs().versions(id).back()));
  return {};
}

Status LockKeeper::leave_frames(const Digest& version) {
  const Scheduler::Job* const job = farm_.scheduler.find_job(version);
  if (job == nullptr) return {};
  const std::set<FrameIndex> frames = farm_.locked(version, job->spec).frames();
  if (frames.empty()) return {};
  return farm_.step(FramesLocked{version, {frames.begin(), frames.end()}});
}

Status LockKeeper::tell(const JobSpec& spec, const JobId& id, const JobLocks& locks) {
  return tell_locks(farm_.journal, spec, farm_.history.jobs().versions(id), id, locks,
                    farm_.options.roots);
}

Status LockKeeper::tell_again(const JobSpec& spec, const JobId& id) {
  return tell_locks_again(farm_.journal, spec, farm_.history.jobs(), id, farm_.options.roots);
}

}  // namespace baton
