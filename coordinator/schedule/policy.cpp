#include "coordinator/schedule/policy.h"

#include <algorithm>

namespace baton {

bool rests(const Crew& crew, const std::string& worker) {
  const Standings& standings = crew.standings;
  if (standings.is_blind(worker, crew.now)) return true;
  if (!standings.has_failed_much(worker, crew.now)) return false;
  return !std::all_of(crew.connected.begin(), crew.connected.end(), [&](const auto& other) {
    return standings.has_failed_much(other, crew.now) || standings.is_blind(other, crew.now);
  });
}

bool are_all_blind(const Crew& crew) {
  return std::all_of(crew.connected.begin(), crew.connected.end(),
                     [&](const auto& worker) { return crew.standings.is_blind(worker, crew.now); });
}

bool may_try(const Crew& crew, const TaskBlame& blame, const std::string& worker) {
  const auto own = blame.find(worker);
  if (own == blame.end()) return true;
  if (own->second.for_good) return false;
  return std::all_of(crew.connected.begin(), crew.connected.end(), [&](const auto& other) {
    if (rests(crew, other)) return true;
    const auto found = blame.find(other);
    return found != blame.end() &&
           (found->second.for_good || found->second.failures >= own->second.failures);
  });
}

bool somebody_may_try(const Crew& crew, const TaskBlame& blame) {
  return std::any_of(crew.connected.begin(), crew.connected.end(), [&](const auto& worker) {
    return !rests(crew, worker) && may_try(crew, blame, worker);
  });
}

bool is_exhausted(std::span<const std::string> connected, const TaskBlame& blame,
                  std::int32_t max_retries) {
  const auto allowed = static_cast<std::size_t>(max_retries) + 1;
  if (blame.size() >= allowed) return true;
  std::size_t failures = 0;
  for (const auto& [worker, own] : blame) failures += static_cast<std::size_t>(own.failures);
  return std::all_of(connected.begin(), connected.end(), [&](const std::string& worker) {
    const auto found = blame.find(worker);
    return found != blame.end() && (found->second.for_good || failures >= allowed);
  });
}

Run last_due_run(const JobGraph& graph, const TaskBook& book, std::int32_t max_frames_ahead) {
  const Timeline& timeline = graph.timeline();
  const Step end = first_open_step(graph, book) + max_frames_ahead;
  return timeline.run_of(std::min(end, Step(timeline.num_steps())) - 1);
}

}  // namespace baton
