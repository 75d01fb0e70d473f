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
  return {rules_.store_limit, store_bytes(), leases_.expected_bytes(), kept_bytes_,
          leases_.empty()};
}

Room Scheduler::room_for(const Job& job, TaskIndex task, Room before) const {
  if (rules_.store_limit == 0) return Room::enough;
  std::vector<JobInStore> others;
  for (const auto& [digest, other] : jobs_) {
    if (&other == &job || !is_open(other.status)) continue;
    others.push_back(other.in_store(other.status == JobStatus::running &&
                                    !leases_.alike(other.renderer).empty()));
  }
  return baton::room_for(room(), job.in_store(), others, task, before);
}

Room RoomOfTasks::operator()(TaskIndex task) {
  const TaskKey key = job_.tasks.graph().key(task);
  if (key.kind == TaskKind::assemble) return Room::enough;
  const std::int32_t place = key.kind == TaskKind::render ? key.run().value() : key.step().value();
  const auto [found, is_new] = known_.try_emplace({key.kind, place});
  if (is_new) found->second = scheduler_.room_for(job_, task, before_);
  lack_ = std::max(lack_, found->second);
  return found->second;
}

Room RoomOfTasks::most() {
  for (const TaskIndex task : job_.tasks.book().ready()) {
    if ((*this)(task) == Room::enough) return Room::enough;
  }
  return lack_;
}

}  // namespace baton
