#include "jobs/slurm/pilots.h"

#include <algorithm>
#include <cstdint>

namespace baton {

int wanted_pilots(const SlurmSnapshot& now) {
  const auto threads = static_cast<std::uint64_t>(std::max(1, now.threads_per_pilot));
  const std::uint64_t enough = (now.tasks + threads - 1) / threads;
  const auto most = static_cast<std::uint64_t>(now.most);
  return std::max(now.least, static_cast<int>(std::min(enough, most)));
}

SlurmOrders give_orders(const SlurmSnapshot& now) {
  SlurmOrders orders;

  // Who is there, and who will be.
  std::vector<SlurmWorker> working = now.workers;
  std::erase_if(working, [](const SlurmWorker& worker) { return worker.told_to_end; });
  std::vector<std::string> coming;
  for (const SlurmPilot& pilot : now.pilots) {
    const bool is_seen = std::any_of(now.workers.begin(), now.workers.end(),
                                     [&](const auto& worker) { return worker.id == pilot.id; });
    const bool is_mute = pilot.state == SlurmState::running && pilot.alone_s > kMostAlone_s;
    if (is_seen || pilot.state == SlurmState::ending || pilot.state == SlurmState::suspended)
      continue;
    (pilot.state == SlurmState::resting || is_mute ? orders.cancel : coming).push_back(pilot.id);
  }

  // Too few, or too many: those that came last go first.
  const int wanted = wanted_pilots(now);
  int surplus = static_cast<int>(working.size() + coming.size()) - wanted;
  orders.submit = std::max(0, -surplus);
  for (; surplus > 0 && !coming.empty(); --surplus) {
    orders.cancel.push_back(coming.back());
    coming.pop_back();
  }
  std::stable_sort(working.begin(), working.end(),
                   [](const auto& a, const auto& b) { return a.leases < b.leases; });
  for (int i = 0; i < surplus; ++i) {
    orders.drain.push_back(working[static_cast<std::size_t>(i)].name);
  }
  return orders;
}

}  // namespace baton
