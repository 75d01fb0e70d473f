#include <fmt/format.h>

#include <algorithm>

#include "common/base/size_text.h"
#include "coordinator/schedule/scheduler.h"

// What the store holds, against its limit. Tasks add states and films, and only assembly and later
// frames take them away. So what may be begun is finished: a run of frames is begun when there is
// room for all of it beside all runs in work, and a task is granted when there is room for what it
// makes.

namespace baton {

void Scheduler::on(const StoreKeeps& event, TimePoint, Actions&) { kept_bytes_ = event.size_bytes; }

/// It goes at once, or when nobody works on the task any more: whoever does may count on it.
void Scheduler::on(const AttemptLeft& attempt, TimePoint, Actions&) {
  const Job* const job = find_job(attempt.lease.job);
  const auto task = job ? job->tasks.graph().find(attempt.lease.task) : std::nullopt;
  if (task && leases_.contains({attempt.lease.job, *task})) {
    std::vector<Digest>& left = left_[{attempt.lease.job, *task}];
    left.insert(left.end(), attempt.blobs.begin(), attempt.blobs.end());
  } else {
    for (const Digest& blob : attempt.blobs) blobs_.discard(blob);
  }
}

/// Whether the store takes so much more, beside what tasks in work will add.
bool Scheduler::fits(std::uint64_t more_bytes) const {
  return store_limit_ == 0 || store_bytes() + expected_bytes_ + more_bytes <= store_limit_;
}

/// Whether a ready task may be granted. others_wait: a job that comes before this one waits for
/// room, so no run is begun.
bool Scheduler::has_room(const Job& job, TaskIndex task, bool others_wait) const {
  const JobGraph& graph = job.tasks.graph();
  const TaskKey key = graph.key(task);
  if (store_limit_ == 0 || key.kind == TaskKind::assemble) return true;
  const bool is_idle = leases_.empty();
  if (!fits(job.sizes.largest(graph, key))) {
    // Where sizes are estimated and nobody works, one task tells more.
    return is_idle && !job.sizes.are_known(graph, key) && store_bytes() < store_limit_;
  }
  // What an idle farm does not begin nobody begins.
  const Run run = key.kind == TaskKind::render ? key.run() : graph.timeline().run_of(key.step());
  if (is_idle) return true;
  if (run >= job.begun_runs) return !others_wait && may_begin(job, run);
  // What is lost of earlier runs, and made again, comes first.
  return store_bytes() + unmade_bytes(job, run) <= store_limit_;
}

/// Whether there is room for all that the run makes, beside what runs in work still make.
bool Scheduler::may_begin(const Job& job, Run run) const {
  std::uint64_t bytes = store_bytes() + unmade_bytes(job, run + 1);
  for (const auto& [digest, other] : jobs_) {
    if (&other != &job && is_open(other.status)) bytes += unmade_bytes(other, other.begun_runs);
  }
  return bytes <= store_limit_;
}

/// What the open tasks of the runs before `end` will add to the store, second passes of frames that
/// are not written included.
std::uint64_t Scheduler::unmade_bytes(const Job& job, Run end) const {
  const JobGraph& graph = job.tasks.graph();
  std::uint64_t bytes = 0;
  for (Run run = job.tasks.first_open_run(); run < end; ++run) {
    bytes += static_cast<std::uint64_t>(job.tasks.num_open_renders(run)) *
             job.sizes.mean(graph, render_task(run, 0));
  }
  if (!job.spec.visibility.correlated || end == Run(0)) return bytes;
  const Timeline& timeline = graph.timeline();
  const Step last = timeline.steps_of(end - 1).last;
  const std::int32_t steps = last + 1 - timeline.last_step_of(job.tasks.first_open_frame());
  return bytes + static_cast<std::uint64_t>(std::max(0, steps)) *
                     static_cast<std::uint64_t>(graph.num_tiles()) *
                     job.sizes.mean(graph, second_pass_task(Step(0), 0));
}

bool Scheduler::lacks_room(const Digest& digest) const {
  const Job& job = jobs_.at(digest);
  if (job.status != JobStatus::running || !leases_.empty() || job.tasks.ready().empty())
    return false;
  // Assembly makes room; its tasks come first.
  for (const auto& [rank, other] : running_) {
    const JobTasks& tasks = jobs_.at(other).tasks;
    if (!tasks.ready().empty() && *tasks.ready().begin() < tasks.graph().num_frames()) return false;
  }
  return !has_room(job, *job.tasks.ready().begin(), false);
}

/// What a job that lacks room waits for.
std::string Scheduler::lacking_room(const Job& job) const {
  const JobGraph& graph = job.tasks.graph();
  return fmt::format(
      "room in the store: it holds {} of the {} that --store-limit allows, {} of them of jobs that "
      "have ended, and the next task needs about {}: raise the limit, or delete ended jobs",
      bytes_text(store_bytes()), bytes_text(store_limit_), bytes_text(kept_bytes_),
      bytes_text(job.sizes.largest(graph, graph.key(*job.tasks.ready().begin()))));
}

}  // namespace baton
