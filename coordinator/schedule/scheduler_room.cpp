#include <fmt/format.h>

#include <algorithm>

#include "common/base/size_text.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {

void Scheduler::on(const StoreKeeps& event, TimePoint, Actions&) { kept_bytes_ = event.size_bytes; }

/// It goes at once, or when nobody works on the task any more: whoever does may count on it.
void Scheduler::on(const AttemptLeft& attempt, TimePoint, Actions&) {
  const Job* const job = find_job(attempt.lease.job);
  const auto task = job ? job->tasks.graph().find(attempt.lease.task) : std::nullopt;
  Lease* const lease = task ? leases_.find({attempt.lease.job, *task}) : nullptr;
  if (lease != nullptr) {
    lease->left.insert(lease->left.end(), attempt.blobs.begin(), attempt.blobs.end());
  } else {
    for (const Digest& blob : attempt.blobs) blobs_.discard(blob);
  }
}

StoreRoom Scheduler::room() const {
  return {rules_.store_limit, store_bytes(), leases_.expected_bytes(), leases_.empty()};
}

/// Whether a ready task of the job may be granted (store_room.h).
bool Scheduler::has_room_for(const Job& job, TaskIndex task, bool others_wait) const {
  if (rules_.store_limit == 0) return true;
  std::vector<JobInStore> others;
  for (const auto& [digest, other] : jobs_) {
    if (&other != &job && is_open(other.status)) others.push_back(other.in_store());
  }
  return has_room(room(), job.in_store(), others, task, others_wait);
}

bool Scheduler::lacks_room(const Digest& digest) const {
  const Job& job = jobs_.at(digest);
  if (job.status != JobStatus::running || !leases_.empty() || job.tasks.book().ready().empty())
    return false;
  // Assembly makes room; its tasks come first.
  for (const auto& [rank, other] : running_) {
    const JobTasks& tasks = jobs_.at(other).tasks;
    if (!tasks.book().ready().empty() && *tasks.book().ready().begin() < tasks.graph().num_frames())
      return false;
  }
  return !has_room_for(job, *job.tasks.book().ready().begin(), false);
}

/// What a job that lacks room waits for.
std::string Scheduler::lacking_room(const Job& job) const {
  const JobGraph& graph = job.tasks.graph();
  return fmt::format(
      "room in the store: it holds {} of the {} that --store-limit allows, {} of them of jobs that "
      "have ended, and the next task needs about {}: raise the limit, or delete ended jobs",
      bytes_text(store_bytes()), bytes_text(rules_.store_limit), bytes_text(kept_bytes_),
      bytes_text(job.sizes.largest(graph, graph.key(*job.tasks.book().ready().begin()))));
}

}  // namespace baton
