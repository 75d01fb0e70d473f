#include "jobs/slurm/pilots.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

namespace baton {
namespace {

bool is_of_array(const std::string& pilot, const std::string& array) {
  return pilot.starts_with(array) && pilot.substr(array.size()).starts_with('_');
}

/// A pilot that the coordinator sees, with the worker of each time that Slurm has started it.
struct WorkingPilot {
  std::vector<std::string> workers;
  int leases = 0;
};

/// In the order of their ids; workers that were told to end do not count.
std::vector<WorkingPilot> working_pilots(const std::vector<SlurmWorker>& workers) {
  std::map<std::string, WorkingPilot> pilots;
  for (const SlurmWorker& worker : workers) {
    if (worker.told_to_end) continue;
    WorkingPilot& pilot = pilots[worker.id];
    pilot.workers.push_back(worker.name);
    pilot.leases += worker.leases;
  }
  std::vector<WorkingPilot> working;
  for (auto& [id, pilot] : pilots) working.push_back(std::move(pilot));
  return working;
}

bool is_mute(const SlurmPilot& pilot) {
  return pilot.state == SlurmState::running && pilot.alone_s > kMostAlone_s;
}

}  // namespace

int wanted_pilots(const SlurmSnapshot& now) {
  const auto threads = static_cast<std::uint64_t>(std::max(1, now.threads_per_pilot));
  const std::uint64_t enough = (now.tasks + threads - 1) / threads;
  const auto most = static_cast<std::uint64_t>(now.most);
  return std::max(now.least, static_cast<int>(std::min(enough, most)));
}

SlurmOrders give_orders(const SlurmSnapshot& now) {
  SlurmOrders orders;

  // Who is there, and who will be.
  std::vector<WorkingPilot> working = working_pilots(now.workers);
  std::vector<std::string> coming;
  for (const SlurmPilot& pilot : now.pilots) {
    const bool is_seen = std::any_of(now.workers.begin(), now.workers.end(),
                                     [&](const auto& worker) { return worker.id == pilot.id; });
    if (is_seen || pilot.state == SlurmState::ending || pilot.state == SlurmState::suspended)
      continue;
    (pilot.state == SlurmState::resting || is_mute(pilot) ? orders.cancel : coming)
        .push_back(pilot.id);
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
    const WorkingPilot& pilot = working[static_cast<std::size_t>(i)];
    orders.drain.insert(orders.drain.end(), pilot.workers.begin(), pilot.workers.end());
  }
  return orders;
}

bool VainArrays::observe(const SlurmSnapshot& now) {
  if (open_.empty()) return false;
  const auto has_come = [&](const SlurmWorker& worker) { return is_of_array(worker.id, open_); };
  if (std::any_of(now.workers.begin(), now.workers.end(), has_come)) {
    open_.clear();
    count_ = 0;
    return false;
  }
  const auto may_come = [&](const SlurmPilot& pilot) {
    return is_of_array(pilot.id, open_) && pilot.state != SlurmState::ending && !is_mute(pilot);
  };
  if (std::any_of(now.pilots.begin(), now.pilots.end(), may_come)) return false;
  last_ = std::exchange(open_, {});
  ++count_;
  return true;
}

void VainArrays::cancelled(const std::vector<std::string>& pilots) {
  const auto is_open = [&](const std::string& pilot) { return is_of_array(pilot, open_); };
  if (std::any_of(pilots.begin(), pilots.end(), is_open)) open_.clear();
}

}  // namespace baton
