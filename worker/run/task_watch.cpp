#include "worker/run/task_watch.h"

#include <algorithm>
#include <utility>

namespace baton {

TaskWatch::Mark::Mark(TaskWatch& watch, const LeaseId& lease, TimePoint deadline,
                      std::string replay)
    : watch_(watch), lease_(lease) {
  const std::lock_guard lock(watch_.mutex_);
  watch_.entries_.insert_or_assign(lease, Entry{deadline, std::move(replay)});
}

TaskWatch::Mark::~Mark() {
  const std::lock_guard lock(watch_.mutex_);
  watch_.entries_.erase(lease_);
}

std::vector<TaskWatch::Overdue> TaskWatch::take_overdue(TimePoint now) {
  const std::lock_guard lock(mutex_);
  std::vector<Overdue> overdue;
  for (auto& [lease, entry] : entries_) {
    if (entry.taken || now <= entry.deadline) continue;
    entry.taken = true;
    overdue.push_back({lease, entry.replay});
  }
  return overdue;
}

bool TaskWatch::is_stuck(TimePoint now) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(entries_.begin(), entries_.end(), [&](const auto& entry) {
    return now > entry.second.deadline + kStopPatience;
  });
}

}  // namespace baton
