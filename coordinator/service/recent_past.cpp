#include "coordinator/service/recent_past.h"

#include <algorithm>

namespace baton {

std::uint64_t RecentPast::kinds() {
  std::uint64_t kinds = 0;
  using enum FarmEventKind;
  for (const FarmEventKind kind :
       {coordinator_started, job_submitted, job_changed, job_resumed, job_paused, job_done,
        job_failed, job_cancelled, job_deleted, worker_joined, worker_left, worker_lost,
        worker_drained, worker_held, worker_released})
    kinds |= bit_of(kind);
  return kinds;
}

void RecentPast::add(const FarmEvent& event) {
  switch (event.kind) {
    case FarmEventKind::coordinator_started:
      // Nobody came since the last one went, whoever was the coordinator then.
      if (!connected_.empty() || alone_since_ms_ == 0) alone_since_ms_ = event.time_ms;
      connected_.clear();
      break;
    case FarmEventKind::job_deleted:
      times_.erase(event.job);
      changes_.erase(event.job);
      break;
    case FarmEventKind::job_submitted:
    case FarmEventKind::job_changed:
    case FarmEventKind::job_resumed:
    case FarmEventKind::job_paused:
    case FarmEventKind::job_done:
    case FarmEventKind::job_failed:
    case FarmEventKind::job_cancelled:
      changes_[event.job] = event;
      break;
    case FarmEventKind::task_done: {
      if (!event.has_task) break;
      std::deque<double>& times = times_[event.job].at(static_cast<std::size_t>(event.task.kind));
      times.push_back(event.seconds);
      if (times.size() > kMostTimes) times.pop_front();
      break;
    }
    case FarmEventKind::worker_joined:
      connected_[event.worker] = {event.time_ms, event.reason};
      absent_.erase(event.worker);
      break;
    case FarmEventKind::worker_drained:
      if (const auto here = connected_.find(event.worker); here != connected_.end())
        here->second.is_draining = true;
      break;
    case FarmEventKind::worker_held:
      held_.insert(event.worker);
      break;
    case FarmEventKind::worker_released:
      held_.erase(event.worker);
      break;
    case FarmEventKind::worker_left:
      held_.erase(event.worker);
      end_worker(event);
      break;
    case FarmEventKind::worker_lost:
      end_worker(event);
      break;
    default:
      break;
  }
}

UsualTime RecentPast::usual(const JobId& job, TaskKind kind) const {
  const auto found = times_.find(job);
  if (found == times_.end()) return {};
  const std::deque<double>& of_kind = found->second.at(static_cast<std::size_t>(kind));
  if (of_kind.empty()) return {};
  std::vector<double> times(of_kind.begin(), of_kind.end());
  std::ranges::sort(times);
  const auto at = [&](double part) {
    const double place = part * static_cast<double>(times.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, times.size() - 1);
    return times[below] + (place - static_cast<double>(below)) * (times[above] - times[below]);
  };
  return {at(0.5), (at(0.75) - at(0.25)) / 2, static_cast<std::int32_t>(times.size())};
}

const FarmEvent* RecentPast::last_change(const JobId& job) const {
  const auto found = changes_.find(job);
  return found == changes_.end() ? nullptr : &found->second;
}

void RecentPast::end_worker(const FarmEvent& event) {
  const auto joined = connected_.extract(event.worker);
  if (joined && connected_.empty()) alone_since_ms_ = event.time_ms;
  if (absent_.size() >= kMostAbsent) absent_.clear();
  AbsentWorker& worker = absent_[event.worker];
  worker = {.worker_id = event.worker, .reason = event.reason, .since_ms = event.time_ms};
  if (event.kind == FarmEventKind::worker_left) worker.absence = Absence::left;
  if (!joined) return;
  worker.about = joined.mapped().about;
  worker.joined_ms = joined.mapped().time_ms;
  if (joined.mapped().is_draining && worker.reason.empty()) worker.reason = "it was told to finish";
}

std::vector<AbsentWorker> RecentPast::lost(std::int64_t since_ms) const {
  std::vector<AbsentWorker> result;
  for (const auto& [name, worker] : absent_) {
    if (worker.absence == Absence::lost && worker.since_ms >= since_ms) result.push_back(worker);
  }
  std::ranges::stable_sort(result, std::greater(), &AbsentWorker::since_ms);
  return result;
}

const AbsentWorker* RecentPast::absent(const std::string& worker) const {
  const auto found = absent_.find(worker);
  return found == absent_.end() ? nullptr : &found->second;
}

}  // namespace baton
