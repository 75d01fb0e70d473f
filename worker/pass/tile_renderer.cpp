#include "worker/pass/tile_renderer.h"

#include <fmt/format.h>

#include "worker/pass/cpu_clock.h"
#include "worker/pass/tile_frame.h"

namespace baton {
namespace {

/// A state must be exactly the one that comes before the run.
Status check_previous(const RenderContext& context, const TileRun& run, const PixelRect& rect,
                      const std::optional<SampleState>& previous) {
  const bool wanted = carries_state(context.job) && run.first_frame > 0;
  if (wanted != previous.has_value()) {
    return Error{ErrorKind::internal, fmt::format("tile {} frame index {}: {} previous state", run.tile, run.first_frame,
                                                  wanted ? "needs a" : "takes no")};
  }
  if (!previous) return {};
  if (previous->job_digest != context.digest) {
    return Error{ErrorKind::bad_input,
                 fmt::format("sample state: of job {}, expected {}", previous->job_digest.hex(), context.digest.hex())};
  }
  if (previous->tile != run.tile || previous->frame_index != run.first_frame - 1 || previous->rect != rect ||
      previous->num_particles != context.job.sampling.num_particles) {
    return Error{ErrorKind::bad_input,
                 fmt::format("sample state: of tile {} frame index {} with {} particles, expected {}, {}, {}",
                             previous->tile, previous->frame_index, previous->num_particles, run.tile,
                             run.first_frame - 1, context.job.sampling.num_particles)};
  }
  return {};
}

}  // namespace

Result<RenderStats> run_tile(const RenderContext& context, const TileRun& run,
                             const std::optional<SampleState>& previous, const TileRunSink& sink,
                             std::stop_token stop) {
  const double start = thread_cpu_seconds();
  const PixelRect rect = context.grid.rect(run.tile);
  BATON_TRY(check_previous(context, run, rect, previous));

  // Take over the previous samples, or start with none.
  SampleState state;
  if (previous) {
    state = *previous;
  } else {
    state.resize(rect, context.job.sampling.num_particles);
  }
  state.job_digest = context.digest;
  state.tile = run.tile;

  // Surfaces once: nothing but the light changes from frame to frame.
  RenderStats primary;
  TileSurfaces surfaces;
  {
    const StageTimer timer(primary.seconds_primary);
    surfaces = trace_primary(context, rect);
    primary.rays_primary = surfaces.rays.size();
  }

  // Frame by frame.
  TileFrameRenderer renderer(context, surfaces);
  double seconds_light = 0;
  for (std::int32_t f = run.first_frame; f <= run.last_frame; ++f) {
    if (stop.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
    std::shared_ptr<const FrameLight> light;
    {
      const StageTimer timer(seconds_light);
      BATON_ASSIGN(light, context.lights->at(f));
    }
    const bool has_history = carries_state(context.job) && (previous.has_value() || f > run.first_frame);
    const FilmTile film = renderer.render(context.frames[static_cast<std::size_t>(f)], *light, has_history, state);
    BATON_TRY(sink.film(f, film));
  }
  if (carries_state(context.job)) BATON_TRY(sink.state(state));

  RenderStats stats = renderer.stats();
  stats.merge(primary);
  stats.seconds_light += seconds_light;
  stats.cpu_seconds += thread_cpu_seconds() - start;
  return stats;
}

}  // namespace baton
