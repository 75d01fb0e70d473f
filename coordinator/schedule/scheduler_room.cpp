#include <algorithm>

#include "coordinator/schedule/scheduler.h"

namespace baton {

void Scheduler::on(const StoreKeeps& event, TimePoint, Actions&) { kept_bytes_ = event.size_bytes; }

/// It goes at once, or when nobody works on the task any more: whoever does may count on it.
void Scheduler::on(const AttemptLeft& attempt, TimePoint, Actions&) {
  const Job* const job = find_job(attempt.lease.job);
  const auto task = job ? job->tasks.graph().find(attempt.lease.task) : std::nullopt;
  Lease* const lease = task ? leases_.find({attempt.lease.job, *task}) : nullptr;
  if (lease != nullptr) {
    // More than that no attempt leaves.
    constexpr std::size_t kMostLeft = 1 << 20;
    lease->left.insert(lease->left.end(), attempt.blobs.begin(), attempt.blobs.end());
    lease->left.resize(std::min(lease->left.size(), kMostLeft));
  } else {
    for (const Digest& blob : attempt.blobs) blobs_.discard(blob);
  }
}

StoreRoom Scheduler::room() const {
  return {rules_.store_limit, store_bytes(), leases_.expected_bytes(), leases_.empty()};
}

bool Scheduler::has_room_for(const Job& job, TaskIndex task, bool others_wait) const {
  if (rules_.store_limit == 0) return true;
  std::vector<JobInStore> others;
  for (const auto& [digest, other] : jobs_) {
    if (&other == &job || !is_open(other.status)) continue;
    // Who cannot go on keeps nobody from what is idle.
    const bool may_go_on =
        other.status == JobStatus::running && !leases_.alike(other.renderer).empty();
    if (may_go_on || !leases_.empty()) others.push_back(other.in_store());
  }
  return has_room(room(), job.in_store(), others, task, others_wait);
}

}  // namespace baton
