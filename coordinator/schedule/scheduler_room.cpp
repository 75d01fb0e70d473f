#include <fmt/format.h>

#include <algorithm>

#include "common/base/size_text.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {
namespace {

/// Whether one of the job's ready tasks could be granted in a store that holds nothing else.
bool could_go_on_alone(const Scheduler::Job& job, std::uint64_t store_limit) {
  const JobTasks& tasks = job.tasks;
  std::uint64_t own = 0;
  for (TaskIndex task = 0; task < tasks.graph().num_tasks(); ++task) {
    for (const auto& blobs : {tasks.ledger().live_blobs(tasks.view(), task),
                              tasks.ledger().spare_blobs(tasks.view(), task)}) {
      for (const BlobRef& blob : blobs)
        own += blob.kind == BlobKind::image || blob.is_held() ? 0 : blob.size_bytes;
    }
  }
  const StoreRoom alone{.limit = store_limit, .used = own};
  return std::ranges::any_of(tasks.book().ready(), [&](TaskIndex task) {
    return room_for(alone, job.in_store(), {}, task, Room::enough) == Room::enough;
  });
}

std::string hopeless_text(const Scheduler::Job& job, std::uint64_t store_limit) {
  const JobInStore in_store = job.in_store();
  const std::uint64_t needed =
      std::max(bytes_alone(in_store), needed_bytes(in_store, *job.tasks.book().ready().begin()));
  return fmt::format(
      "the store is too small for it: it needs about {} at once, and --store-limit allows {}: "
      "raise the limit, and submit it again",
      bytes_text(needed), bytes_text(store_limit));
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
/// lost goes; jobs fail that could not go on if they were alone, or else the last one that could
/// not end; and where all could, the last one begins again after the others.
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

  const auto fail = [&](const Digest& digest) {
    Job& job = jobs_.at(digest);
    job.is_hopeless = true;
    end_job(digest, job, JobStatus::failed, hopeless_text(job, rules_.store_limit), actions);
  };
  const auto goes_on = [&](const Digest& digest) {
    return could_go_on_alone(jobs_.at(digest), rules_.store_limit);
  };
  const auto end = std::ranges::stable_partition(stuck, goes_on).begin();
  std::for_each(end, stuck.end(), fail);
  if (end != stuck.end()) return;
  std::erase_if(stuck, [&](const Digest& job) { return jobs_.at(job).begun_runs == Run(0); });
  if (stuck.size() < 2) return;
  const auto hopeless = std::ranges::find_if(stuck.rbegin(), stuck.rend(), [&](const Digest& job) {
    return bytes_alone(jobs_.at(job).in_store()) > rules_.store_limit;
  });
  if (hopeless != stuck.rend()) return fail(*hopeless);

  // All that the last one has in the store is made once more.
  Job& last = jobs_.at(stuck.back());
  RecordReopened all{stuck.back(), {}, "other jobs need its room in the store"};
  const JobGraph& graph = last.tasks.graph();
  for (TaskIndex task = graph.num_frames(); task < graph.num_tasks(); ++task) {
    if (!last.tasks.ledger().live_blobs(last.tasks.view(), task).empty())
      all.tasks.push_back(graph.key(task));
  }
  reopen(std::move(all), last, actions);
  last.begun_runs = Run(0);
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
