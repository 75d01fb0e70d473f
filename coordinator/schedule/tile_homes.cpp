#include "coordinator/schedule/tile_homes.h"

#include <algorithm>

#include "common/job/motion.h"

namespace baton {

TileHomes::TileHomes(const JobSpec& job) : grid_(job.image), reach_px_(history_reach_px(job)) {
  if (carries_state(job) && shares_history(job))
    homes_.resize(static_cast<std::size_t>(grid_.count()));
}

void TileHomes::settle(std::int32_t tile, const std::string& worker) {
  if (matter()) homes_[static_cast<std::size_t>(tile)] = worker;
}

void TileHomes::leave(const std::string& worker) {
  std::replace(homes_.begin(), homes_.end(), worker, std::string());
}

std::optional<TaskIndex> TileHomes::choose(const JobGraph& graph, const std::set<TaskIndex>& ready,
                                           std::int32_t last_run, const Asker& asker) const {
  std::vector<TaskIndex> others;  // of the earliest run
  std::int32_t first_run = last_run;
  for (const TaskIndex task : ready) {
    const TaskKey key = graph.key(task);
    const bool is_render = key.kind == TaskKind::render;
    if (is_render && (key.step > last_run || key.step > first_run + 1)) break;
    if (!asker.may_try(task)) continue;
    if (!is_render || !matter() || is_home(key.tile, asker)) return task;
    if (others.empty()) first_run = key.step;
    if (key.step == first_run) others.push_back(task);
  }
  const auto nearest =
      std::max_element(others.begin(), others.end(), [&](const TaskIndex a, const TaskIndex b) {
        return num_own_near(graph.key(a).tile, asker) < num_own_near(graph.key(b).tile, asker);
      });
  return nearest == others.end() ? std::nullopt : std::optional(*nearest);
}

bool TileHomes::surround(std::int32_t tile, const Asker& asker) const {
  if (!matter()) return false;
  const std::vector<std::int32_t> near = grid_.tiles_near(tile, 2 * reach_px_);
  return std::all_of(near.begin(), near.end(),
                     [&](std::int32_t other) { return is_home(other, asker); });
}

bool TileHomes::is_home(std::int32_t tile, const Asker& asker) const {
  const std::string& home = homes_[static_cast<std::size_t>(tile)];
  if (!home.empty()) return home == asker.worker;
  const std::int32_t columns = grid_.columns(), rows = grid_.rows();
  const std::int32_t place = columns < rows ? tile : tile % columns * rows + tile / columns;
  return static_cast<std::size_t>(place) * asker.num_workers / homes_.size() == asker.position;
}

std::int64_t TileHomes::num_own_near(std::int32_t tile, const Asker& asker) const {
  const std::vector<std::int32_t> near = grid_.tiles_near(tile, reach_px_);
  return std::count_if(near.begin(), near.end(),
                       [&](std::int32_t other) { return is_home(other, asker); });
}

}  // namespace baton
