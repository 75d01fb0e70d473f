#include "worker/pass/tile_renderer.h"

#include <fmt/format.h>

#include "common/job/motion.h"
#include "worker/pass/cpu_clock.h"
#include "worker/pass/tile_frame.h"

namespace baton {
namespace {

/// A state must be that of the job, a tile and a frame.
Status check_state(const RenderContext& context, const SampleState& state, std::int32_t tile, std::int32_t frame_index) {
  if (state.job_digest != context.digest) {
    return Error{ErrorKind::bad_input,
                 fmt::format("sample state: of job {}, expected {}", state.job_digest.hex(), context.digest.hex())};
  }
  const std::int32_t num_particles = context.job.sampling.num_particles;
  if (state.tile != tile || state.frame_index != frame_index || state.rect != context.grid.rect(tile) ||
      state.num_particles != num_particles || state.num_populations != num_populations(context.job)) {
    return Error{ErrorKind::bad_input, fmt::format("sample state: of tile {} frame index {} with {} particles, expected {}, "
                                                   "{}, {}",
                                                   state.tile, state.frame_index, state.num_particles, tile, frame_index,
                                                   num_particles)};
  }
  return {};
}

/// The states must be exactly those that come before the run.
Status check_previous(const RenderContext& context, const TileRun& run, std::span<const StatePtr> previous) {
  std::vector<std::int32_t> tiles;
  if (carries_state(context.job) && run.first_frame > 0)
    tiles = context.grid.tiles_near(run.tile, history_reach_px(context.job));
  if (previous.size() != tiles.size()) {
    return Error{ErrorKind::internal, fmt::format("tile {} frame index {}: got {} previous states, expected {}", run.tile,
                                                  run.first_frame, previous.size(), tiles.size())};
  }
  for (std::size_t i = 0; i < tiles.size(); ++i)
    BATON_TRY(check_state(context, *previous[i], tiles[i], run.first_frame - 1));
  return {};
}

}  // namespace

Result<RenderStats> run_tile(const RenderContext& context, const TileRun& run,
                             std::span<const StatePtr> previous, const TileRunSink& sink, std::stop_token stop) {
  const double start = thread_cpu_seconds();
  const PixelRect rect = context.grid.rect(run.tile);
  BATON_TRY(check_previous(context, run, previous));

  // Take over the previous samples, or start with none.
  SampleState state;
  if (!previous.empty()) {
    state = *previous.front();
  } else {
    state.resize(rect, context.job.sampling.num_particles, num_populations(context.job));
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
    const bool has_history = carries_state(context.job) && (!previous.empty() || f > run.first_frame);
    const FilmTile film = renderer.render(context.frames[static_cast<std::size_t>(f)], *light, has_history, state);
    BATON_TRY(sink.film(f, film));
    if (sink.diagnostics) sink.diagnostics({f, run.tile, renderer.frame_sampling()});
    if (context.job.visibility.correlated) BATON_TRY(sink.samples(renderer.take_first_pass(state)));
  }
  if (carries_state(context.job)) BATON_TRY(sink.state(state));

  RenderStats stats = renderer.stats();
  stats.merge(primary);
  stats.seconds_light += seconds_light;
  stats.cpu_seconds += thread_cpu_seconds() - start;
  return stats;
}

}  // namespace baton
