#include "coordinator/service/turned_away.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "common/base/limits.h"
#include "common/base/utc.h"

namespace baton {

TimePoint TurnedAway::add(const WorkerHello& hello, const std::string& reason, TimePoint now) {
  // Of the processes of one name the newest is enough.
  std::erase_if(entries_, [&](const auto& entry) {
    return entry.first != hello.instance && entry.second.worker.worker_id == hello.worker_id;
  });
  if (entries_.size() >= limits::kMaxWorkers && !entries_.contains(hello.instance))
    entries_.clear();
  Entry& entry = entries_.try_emplace(hello.instance, Entry{{}, now, now}).first->second;
  entry.worker = {.worker_id = hello.worker_id,
                  .absence = Absence::turned_away,
                  .about = worker_text(hello),
                  .reason = reason,
                  .since_ms = now_ms()};
  entry.last = now;
  return entry.first;
}

void TurnedAway::remove(const WorkerHello& hello) {
  std::erase_if(entries_, [&](const auto& entry) {
    return entry.first == hello.instance || entry.second.worker.worker_id == hello.worker_id;
  });
}

std::vector<AbsentWorker> TurnedAway::asked_within(std::chrono::milliseconds age,
                                                   TimePoint now) const {
  std::vector<AbsentWorker> workers;
  for (const auto& [instance, entry] : entries_) {
    if (now - entry.last <= age) workers.push_back(entry.worker);
  }
  std::ranges::stable_sort(workers, std::greater(), &AbsentWorker::since_ms);
  return workers;
}

std::string worker_text(const WorkerHello& hello) {
  return fmt::format("{} threads on {}, {}", hello.num_threads, hello.host, hello.renderer);
}

}  // namespace baton
