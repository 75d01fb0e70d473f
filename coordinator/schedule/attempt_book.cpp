#include "coordinator/schedule/attempt_book.h"

#include <algorithm>

#include "common/base/legible.h"

namespace baton {

void AttemptBook::add_failure(TaskIndex task, const Failure& failure) {
  has_failed_ = true;
  constexpr std::size_t kMostShown = 300;
  const std::string_view message = first_line(failure.message).substr(0, kMostShown);
  ended_[task].push_back(
      {failure.lease, failure.worker, true, failure.permanent, std::string(message)});
  ++num_lost_;
}

void AttemptBook::add_returned(TaskIndex task, const LeaseId& lease, const std::string& worker) {
  // One for each worker will do: one that comes again after that is reported again, too.
  std::vector<Ended>& ended = ended_[task];
  std::erase_if(ended,
                [&](const Ended& attempt) { return !attempt.failed && attempt.worker == worker; });
  ended.push_back({lease, worker});
}

std::int32_t AttemptBook::add_loss(TaskIndex task) {
  ++num_lost_;
  return ++losses_[task];
}

void AttemptBook::forgive(const std::string& worker) {
  for (auto& [task, ended] : ended_) {
    for (Ended& attempt : ended) {
      if (attempt.worker == worker) attempt.for_good = false;
    }
  }
}

bool AttemptBook::has_ended(TaskIndex task, const LeaseId& lease) const {
  const auto found = ended_.find(task);
  if (found == ended_.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const Ended& attempt) { return attempt.lease == lease; });
}

std::vector<TaskIndex> AttemptBook::tried() const {
  std::vector<TaskIndex> tasks;
  for (const auto& [task, ended] : ended_) tasks.push_back(task);
  return tasks;
}

std::map<std::string, Blame> AttemptBook::blame(TaskIndex task) const {
  std::map<std::string, Blame> blame;
  const auto found = ended_.find(task);
  if (found == ended_.end()) return blame;
  for (const Ended& attempt : found->second) {
    if (!attempt.failed) continue;
    Blame& of_worker = blame[attempt.worker];
    ++of_worker.failures;
    of_worker.for_good |= attempt.for_good;
    of_worker.message = attempt.message;
  }
  return blame;
}

}  // namespace baton
