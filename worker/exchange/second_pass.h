#pragma once

#include <span>

#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/job/task.h"
#include "worker/exchange/sample_region.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// A finished tile with what it cost.
struct SecondPassOutput {
  FilmTile film;
  RenderStats stats = {};
  double seconds_primary_rays = 0;  ///< CPU time of tracing primary rays again
};

/// The second pass of one tile of one frame: the first pass's film with the pixels of the mask done
/// again from the samples of all pixels within reach. near: the first-pass samples of all tiles
/// within exchange_reach_px (TileGrid::tiles_near, in that order). The bytes are a function of the
/// arguments alone, and the image is the same for any tiling. Errors: samples of another job, frame
/// or tile; a film of another tile.
Result<SecondPassOutput> run_second_pass(const RenderContext& context, Step step, std::int32_t tile,
                                         const FilmTile& first_film,
                                         std::span<const FirstPassPtr> near);

}  // namespace baton
