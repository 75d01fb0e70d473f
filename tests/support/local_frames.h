#pragma once

#include <functional>
#include <numeric>

#include "worker/pass/render_context.h"
#include "worker/run/frame_output.h"
#include "worker/run/local_render.h"

namespace baton::test {

/// Receives a finished image.
using FrameSink = std::function<Status(Step step, const FilmTile& image)>;

/// The image of the frame that is kept; adds what its tiles counted.
inline Result<FilmTile> local_image(const LocalRender& render, const JobSpec& job, Step step,
                                    RenderStats& stats) {
  FilmTile image = blank_image(job.image.rendered(), render.tiles().begin()->second.film.channels);
  for (const auto& [tile, first_pass] : render.tiles()) {
    BATON_ASSIGN(const RenderedTile finished, render.finished(step, tile));
    BATON_TRY(paste_tile(finished.film, image));
    stats.merge(finished.stats);
  }
  return image;
}

/// Renders every frame of the context's job.
inline Result<RenderStats> render_locally(const RenderContext& context, const FrameSink& sink) {
  LocalRender render(context);
  std::set<std::int32_t> tiles;
  for (std::int32_t tile = 0; tile < context.grid.count(); ++tile) tiles.insert(tile);
  RenderStats stats;
  for (Step step; step.index() < context.job.frames.size(); ++step) {
    BATON_TRY(render.render_all(step, tiles));
    BATON_ASSIGN(const FilmTile image, local_image(render, context.job, step, stats));
    BATON_TRY(sink(step, image));
  }
  return stats;
}

}  // namespace baton::test
