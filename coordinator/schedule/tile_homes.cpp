#include "coordinator/schedule/tile_homes.h"

#include <algorithm>

#include "common/job/motion.h"

namespace baton {

TileHomes::TileHomes(const JobSpec& job) : grid_(job.image), reach_px_(history_reach_px(job)) {
  if (carries_state(job) && shares_history(job))
    homes_.resize(static_cast<std::size_t>(grid_.count()));
}

void TileHomes::share_out(const std::vector<std::string>& workers) {
  for (std::size_t i = 0; i < homes_.size(); ++i)
    homes_[i] = workers.empty() ? std::string() : workers[i * workers.size() / homes_.size()];
}

void TileHomes::leave(const std::string& worker) {
  const auto [first, end] = strip(worker);
  const std::size_t middle = (first + end) / 2;
  const std::string before = first > 0 ? homes_[first - 1] : std::string();
  const std::string after = end < homes_.size() ? homes_[end] : before;
  for (std::size_t i = first; i < end; ++i) homes_[i] = i < middle && first > 0 ? before : after;
}

void TileHomes::assign(std::int32_t tile, const std::string& worker) {
  if (is_home(tile, worker)) return;
  const auto [first, end] = strip(homes_[place(tile)]);
  const auto [own_first, own_end] = strip(worker);
  const auto at = [this](std::size_t i) { return homes_.begin() + static_cast<std::ptrdiff_t>(i); };
  // Strips between the two move by a tile.
  if (own_first == own_end) {
    homes_[first] = worker;
  } else if (own_end <= first) {
    std::rotate(at(own_end), at(first), at(first + 1));
    homes_[own_end] = worker;
  } else {
    std::rotate(at(end - 1), at(end), at(own_first));
    homes_[own_first - 1] = worker;
  }
}

std::pair<std::size_t, std::size_t> TileHomes::strip(const std::string& worker) const {
  const auto first = std::find(homes_.begin(), homes_.end(), worker);
  const auto end =
      std::find_if(first, homes_.end(), [&](const auto& home) { return home != worker; });
  return {static_cast<std::size_t>(first - homes_.begin()),
          static_cast<std::size_t>(end - homes_.begin())};
}

std::size_t TileHomes::place(std::int32_t tile) const {
  const std::int32_t columns = grid_.columns(), rows = grid_.rows();
  return static_cast<std::size_t>(columns < rows ? tile : tile % columns * rows + tile / columns);
}

bool TileHomes::is_home(std::int32_t tile, const std::string& worker) const {
  return !matter() || homes_[place(tile)] == worker;
}

bool TileHomes::surround(std::int32_t tile, const std::string& worker) const {
  if (!matter()) return false;
  const std::vector<std::int32_t> near = grid_.tiles_near(tile, reach_px_);
  return std::all_of(near.begin(), near.end(),
                     [&](std::int32_t other) { return is_home(other, worker); });
}

std::int64_t TileHomes::num_own_near(std::int32_t tile, const std::string& worker) const {
  const std::vector<std::int32_t> near = grid_.tiles_near(tile, reach_px_);
  return std::count_if(near.begin(), near.end(),
                       [&](std::int32_t other) { return is_home(other, worker); });
}

std::optional<TaskIndex> TileHomes::choose(const JobGraph& graph, const std::set<TaskIndex>& ready,
                                           Run last_run, const std::string& worker,
                                           const std::function<bool(TaskIndex)>& may_try) const {
  std::vector<TaskIndex> others;  // of the earliest run
  Run first_run = last_run;
  for (const TaskIndex task : ready) {
    const TaskKey key = graph.key(task);
    const bool is_render = key.kind == TaskKind::render;
    if (is_render && (key.run() > last_run || key.run() > first_run + 1)) break;
    if (!may_try(task)) continue;
    if (!is_render || is_home(key.tile, worker)) return task;
    if (others.empty()) first_run = key.run();
    if (key.run() == first_run) others.push_back(task);
  }
  const auto nearest =
      std::max_element(others.begin(), others.end(), [&](const TaskIndex a, const TaskIndex b) {
        return num_own_near(graph.key(a).tile, worker) < num_own_near(graph.key(b).tile, worker);
      });
  return nearest == others.end() ? std::nullopt : std::optional(*nearest);
}

}  // namespace baton
