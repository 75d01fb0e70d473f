#pragma once

#include <functional>
#include <stop_token>

#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/job/job_spec.h"
#include "common/job/task.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

/// Receives a finished image; frame_index is 0-based. Called on a render thread, for different
/// frames possibly at the same time and not in order.
using FrameSink = std::function<Status(std::int32_t frame_index, const FilmTile& image)>;

/// Renders every tile of every frame of the job in this process with `num_threads` threads: no
/// coordinator, no store, no files. The images are those of the farm; the time is what the farm's
/// overhead is measured against. `context` is that of `job`. Errors: the renderer's, the sink's;
/// cancelled when `stop` is requested.
Result<RenderStats> render_locally(const RenderContext& context, const JobSpec& job,
                                   int num_threads, const FrameSink& sink,
                                   const std::stop_token& stop = {});

}  // namespace baton
