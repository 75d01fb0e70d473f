#pragma once

#include <functional>
#include <numeric>

#include "worker/pass/render_context.h"
#include "worker/run/frame_output.h"
#include "worker/run/local_render.h"

namespace baton::test {

/// Receives a finished image; frame_index is 0-based.
using FrameSink = std::function<Status(std::int32_t frame_index, const FilmTile& image)>;

/// The image of the frame that is kept; adds what its tiles counted.
inline Result<FilmTile> local_image(const LocalRender& render, const JobSpec& job,
                                    std::int32_t frame, RenderStats& stats) {
  FilmTile image = blank_image(job.image, render.tiles().begin()->second.film.channels);
  for (const auto& [tile, first_pass] : render.tiles()) {
    BATON_ASSIGN(const RenderedTile finished, render.finished(frame, tile));
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
  for (std::int32_t frame = 0; frame < std::ssize(context.job.frames); ++frame) {
    BATON_TRY(render.render_all(frame, tiles));
    BATON_ASSIGN(const FilmTile image, local_image(render, context.job, frame, stats));
    BATON_TRY(sink(frame, image));
  }
  return stats;
}

}  // namespace baton::test
