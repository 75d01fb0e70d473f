#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/size_text.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {
namespace {

/// What the job has in the store.
std::uint64_t own_bytes(const Scheduler::Job& job) {
  const JobTasks& tasks = job.tasks;
  std::uint64_t own = 0;
  for (TaskIndex task = 0; task < tasks.graph().num_tasks(); ++task) {
    for (const auto& blobs : {tasks.ledger().live_blobs(tasks.view(), task),
                              tasks.ledger().spare_blobs(tasks.view(), task)}) {
      for (const BlobRef& blob : blobs)
        own += blob.kind == BlobKind::image || blob.is_held() ? 0 : blob.size_bytes;
    }
  }
  return own;
}

/// Whether one of the job's ready tasks could be granted in such a store.
bool could_go_on(const Scheduler::Job& job, const StoreRoom& room) {
  return std::ranges::any_of(job.tasks.book().ready(), [&](TaskIndex task) {
    return room_for(room, job.in_store(), {}, task, Room::enough) == Room::enough;
  });
}

std::string hopeless_text(const Scheduler::Job& job, std::uint64_t store_limit) {
  const TaskIndex next = *job.tasks.book().ready().begin();
  return fmt::format(
      "the store is too small for it: its next frames need {} beside the {} that it has made, and "
      "--store-limit allows {}: raise the limit, and submit it again",
      bytes_text(needed_bytes(job.in_store(), next)), bytes_text(own_bytes(job)),
      bytes_text(store_limit));
}

}  // namespace

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

/// Where nobody finds work, room is made, until somebody does: what stays for workers that may be
/// lost goes; jobs fail that could not go on if they were alone; and where all could, the last one
/// begins again after the others. Where only jobs that have ended are in the way, it waits.
void Scheduler::make_room(Actions& actions) {
  if (rules_.store_limit == 0 || !leases_.empty() || leases_.connected().empty()) return;
  std::vector<Digest> stuck;
  for (const Digest& digest : in_turn()) {
    const Job& job = jobs_.at(digest);
    if (job.tasks.book().ready().empty()) continue;
    if (RoomOfTasks(*this, job, Room::enough).most() == Room::enough) return;
    stuck.push_back(digest);
  }
  const std::uint64_t held = store_bytes();
  for (auto& [digest, job] : jobs_) {
    if (is_open(job.status)) job.tasks.let_between_go(blobs_);
  }
  if (store_bytes() < held) return;

  const auto could_alone = [&](const Digest& digest) {
    const Job& job = jobs_.at(digest);
    return could_go_on(job, {.limit = rules_.store_limit, .used = own_bytes(job)});
  };
  const auto end = std::ranges::stable_partition(stuck, could_alone).begin();
  for (const Digest& digest : std::ranges::subrange(end, stuck.end())) {
    Job& job = jobs_.at(digest);
    job.is_hopeless = true;
    end_job(digest, job, JobStatus::failed, hopeless_text(job, rules_.store_limit), actions);
  }
  if (end != stuck.end()) return;
  const std::uint64_t kept = std::exchange(kept_bytes_, 0);
  const bool ended_are_in_the_way = std::ranges::any_of(stuck, [&](const Digest& job) {
    return RoomOfTasks(*this, jobs_.at(job), Room::enough).most() == Room::enough;
  });
  kept_bytes_ = kept;
  std::erase_if(stuck, [&](const Digest& job) { return jobs_.at(job).begun_runs == Run(0); });
  if (ended_are_in_the_way || stuck.size() < 2) return;

  // All that the last one has in the store is made once more, and what that needs.
  Job& last = jobs_.at(stuck.back());
  const JobGraph& graph = last.tasks.graph();
  RecordReopened all{stuck.back(), {}, "other jobs need its room in the store"};
  do {
    reopen(std::exchange(all, RecordReopened{all.job, {}, all.why}), last, actions);
    for (TaskIndex task = graph.num_frames(); task < graph.num_tasks(); ++task) {
      if (!last.tasks.ledger().live_blobs(last.tasks.view(), task).empty())
        all.tasks.push_back(graph.key(task));
    }
  } while (!all.tasks.empty());
  last.begun_runs = Run(0);
  last.yields = true;
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
