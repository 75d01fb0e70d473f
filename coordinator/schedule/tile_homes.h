#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/sequence.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {

/// Which worker a tile is at home with: the one that rendered it last still has its state decoded,
/// and those of its neighbours if they are at home there, too. A preference, never a bond: a worker
/// that has no tile of its own to render takes somebody else's, and that tile has a new home. Where
/// no tile needs another's state nobody has a home.
class TileHomes {
 public:
  explicit TileHomes(const JobSpec& job);

  /// Whether any tile needs another's state.
  bool matter() const { return !homes_.empty(); }
  /// The worker begins to render the tile.
  void settle(std::int32_t tile, const std::string& worker);
  /// The worker is gone.
  void leave(const std::string& worker);

  struct Asker;
  /// Whether all tiles within twice the reach of history are at home with the asker: then whoever
  /// needs the tile's state, or has a neighbour that does, is the asker itself.
  bool surround(std::int32_t tile, const Asker& asker) const;

  /// The worker that requests a task.
  struct Asker {
    std::string worker;
    std::size_t position = 0, num_workers = 1;  ///< among the workers that may have tasks
    std::function<bool(TaskIndex)> may_try;
  };
  /// The one of the ready tasks that the asker should have, render tasks up to `last_run`: assembly
  /// and second passes first; then a tile of its own, in the earliest run of all or the one after;
  /// then of that earliest run the tile with most of its own tiles around it. Tiles without a home
  /// are shared out in strips across the longer side of the image, which have the shortest borders.
  /// nullopt: there is none.
  std::optional<TaskIndex> choose(const JobGraph& graph, const std::set<TaskIndex>& ready,
                                  std::int32_t last_run, const Asker& asker) const;

 private:
  bool is_home(std::int32_t tile, const Asker& asker) const;
  std::int64_t num_own_near(std::int32_t tile, const Asker& asker) const;

  TileGrid grid_;
  std::int32_t reach_px_;
  std::vector<std::string> homes_;  ///< of each tile, "" at first; empty: nobody has one
};

}  // namespace baton
