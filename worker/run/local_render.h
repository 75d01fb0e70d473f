#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/job/task.h"
#include "worker/exchange/sample_region.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// What a tile is after a frame.
struct RenderedTile {
  FilmTile film;
  StatePtr state;        ///< null: nothing is carried
  FirstPassPtr samples;  ///< null: no second pass
  RenderStats stats;
};

/// The frames of a job's first sweep, one after the other in this process: no coordinator, no
/// store, no files. The pixels are those of the farm.
class LocalRender {
 public:
  /// context must outlive the object.
  explicit LocalRender(const RenderContext& context) : context_(context) {}

  /// For each frame before `step` the tiles without which `wanted` of that step
  /// cannot be rendered; none where nothing is carried.
  std::vector<std::set<std::int32_t>> tiles_before(Step step, std::set<std::int32_t> wanted) const;

  /// Renders a tile of the step after those that are kept. Any number of threads. Errors: the
  /// renderer's.
  Result<RenderedTile> render(Step step, std::int32_t tile) const;
  /// Keeps the tiles of a frame in place of those of the frame before.
  void keep(std::map<std::int32_t, RenderedTile> tiles) { tiles_ = std::move(tiles); }
  /// Both, for all of these tiles.
  Status render_all(Step step, const std::set<std::int32_t>& tiles);

  const std::map<std::int32_t, RenderedTile>& tiles() const { return tiles_; }
  /// A tile of the frame that is kept after the job's second pass, if it has one; what is near it
  /// must be kept, too.
  Result<RenderedTile> finished(Step step, std::int32_t tile) const;

 private:
  const RenderContext& context_;
  std::map<std::int32_t, RenderedTile> tiles_;
};

}  // namespace baton
