#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/job/plan/sequence.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {

/// Which worker a tile is at home with: the one that renders it still has its state decoded, and
/// those of its neighbours if they are at home there, too. The homes of a worker are a strip across
/// the longer side of the image, the shape with the shortest border. A preference, never a bond: a
/// worker that has no tile of its own to render takes somebody else's, and its strip grows by a
/// tile at the cost of that one's. Where no tile needs another's state nobody has a home.
class TileHomes {
 public:
  explicit TileHomes(const JobSpec& job);

  /// Whether any tile needs another's state.
  bool matter() const { return !homes_.empty(); }
  /// All tiles in strips of equal size, in the order of the workers.
  void share_out(const std::vector<std::string>& workers);
  /// The worker is gone; who is beside it has its strip.
  void leave(const std::string& worker);
  /// The worker begins to render the tile.
  void assign(std::int32_t tile, const std::string& worker);

  bool is_home(std::int32_t tile, const std::string& worker) const;
  /// Whether all tiles within the reach of history are at home with the worker: then whoever needs
  /// the tile's state is this worker.
  bool surround(std::int32_t tile, const std::string& worker) const;

  /// The one of the ready tasks that a worker should have which may try some of them, render tasks
  /// up to `last_run`: assembly and second passes first; then a tile of its own, in the earliest
  /// run of all or the one after; then of that earliest run the tile with most of its own tiles
  /// around it. nullopt: there is none.
  std::optional<TaskIndex> choose(const JobGraph& graph, const std::set<TaskIndex>& ready,
                                  Run last_run, const std::string& worker,
                                  const std::function<bool(TaskIndex)>& may_try) const;

 private:
  std::size_t place(std::int32_t tile) const;
  /// The worker's places, [first, end).
  std::pair<std::size_t, std::size_t> strip(const std::string& worker) const;
  std::int64_t num_own_near(std::int32_t tile, const std::string& worker) const;

  TileGrid grid_;
  std::int32_t reach_px_;
  /// By place along the longer side; empty: nobody has one.
  std::vector<std::string> homes_;
};

}  // namespace baton
