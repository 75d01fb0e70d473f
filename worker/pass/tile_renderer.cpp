#include "worker/pass/tile_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/job/motion.h"
#include "worker/pass/cpu_clock.h"
#include "worker/pass/tile_frame.h"

namespace baton {
namespace {

/// A state must be that of the job, a tile and a frame.
Status check_state(const RenderContext& context, const SampleState& state, std::int32_t tile,
                   std::int32_t frame_index) {
  if (state.picture != context.picture) {
    return Error{ErrorKind::bad_input, fmt::format("sample state: of picture {}, expected {}",
                                                   state.picture.hex(), context.picture.hex())};
  }
  const std::int32_t num_particles = num_carried_particles(context.job.sampling);
  if (state.tile != tile || state.frame_index != frame_index ||
      state.rect != context.grid.rect(tile) || state.num_particles != num_particles ||
      state.num_populations != num_populations(context.job)) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("sample state: of tile {} frame index {} with {} particles, expected {}, "
                    "{}, {}",
                    state.tile, state.frame_index, state.num_particles, tile, frame_index,
                    num_particles)};
  }
  return {};
}

/// The states must be exactly those that come before the run.
Status check_previous(const RenderContext& context, const TileRun& run,
                      std::span<const StatePtr> previous) {
  std::vector<std::int32_t> tiles;
  if (carries_state(context.job) && run.first_frame > 0)
    tiles = context.grid.tiles_near(run.tile, history_reach_px(context.job));
  if (previous.size() != tiles.size()) {
    return Error{ErrorKind::internal,
                 fmt::format("tile {} frame index {}: got {} previous states, expected {}",
                             run.tile, run.first_frame, previous.size(), tiles.size())};
  }
  for (std::size_t i = 0; i < tiles.size(); ++i)
    BATON_TRY(check_state(context, *previous[i], tiles[i], run.first_frame - 1));
  return {};
}

/// A tile on its way through its frames.
class TileWalk {
 public:
  TileWalk(const RenderContext& context, const TileRun& run)
      : context_(context), rect_(context.grid.rect(run.tile)) {
    start_state();
    state_.picture = context.picture;
    state_.tile = run.tile;
  }

  /// Where surfaces stay: the tile's own samples go on.
  void go_on_from(const SampleState& previous) {
    state_ = previous;
    has_history_ = true;
  }

  /// Renders the next frame with the surfaces of all frames.
  Result<FilmTile> render_still(const FrameSpec& frame) {
    BATON_ASSIGN(const std::shared_ptr<const FrameLight> light, light_of(frame));
    if (renderer_ == nullptr) {
      BATON_ASSIGN(geometry_, context_.geometry->at(frame.index));
      renderer_ = std::make_unique<TileFrameRenderer>(context_, *geometry_, trace(*geometry_));
    }
    FilmTile film = renderer_->render(frame, *light, has_history_, state_);
    has_history_ = carries_state(context_.job);
    return film;
  }

  /// Renders one frame with surfaces of its own, its history taken from `previous`: the states of
  /// all tiles that it may come from, or none.
  Result<FilmTile> render_sharing(const FrameSpec& frame, std::span<const StatePtr> previous) {
    BATON_ASSIGN(const std::shared_ptr<const FrameLight> light, light_of(frame));
    BATON_ASSIGN(geometry_, context_.geometry->at(frame.index));
    BATON_ASSIGN(const std::shared_ptr<const FrameGeometry> before,
                 context_.geometry->at(std::max(frame.index - 1, 0)));
    start_state();
    if (renderer_ != nullptr) stats_.merge(renderer_->stats());
    renderer_ = std::make_unique<TileFrameRenderer>(context_, *geometry_, trace(*geometry_));
    context_.surfaces->insert({frame.index, state_.tile}, surfaces_);
    Reprojection history(context_, *geometry_, *before, previous);
    return renderer_->render(frame, *light, history, state_);
  }

  /// At the end of the walk.
  SampleState take_state() { return std::move(state_); }
  /// Of the frame that was rendered last.
  const SamplingStats& frame_sampling() const { return renderer_->frame_sampling(); }
  /// What the second pass needs of that frame.
  FirstPassSamples take_first_pass() { return renderer_->take_first_pass(state_); }
  RenderStats stats() const {
    RenderStats stats = stats_;
    if (renderer_ != nullptr) stats.merge(renderer_->stats());
    return stats;
  }

 private:
  /// Empties the samples.
  void start_state() {
    state_.resize(rect_, num_carried_particles(context_.job.sampling),
                  num_populations(context_.job));
    if (!carries_state(context_.job)) return;
    const Carried carried = traits(context_.job.sampling.method).carried;
    if (carried == Carried::memory) state_.add_memory();
    if (carried == Carried::weighed_samples) state_.add_confidence();
  }
  Result<std::shared_ptr<const FrameLight>> light_of(const FrameSpec& frame) {
    const CpuTimer timer(stats_.seconds_light);
    return context_.lights->at(frame.index);
  }
  const TileSurfaces& trace(const FrameGeometry& geometry) {
    const CpuTimer timer(stats_.seconds_primary);
    surfaces_ = std::make_shared<const TileSurfaces>(trace_primary(context_.job, geometry, rect_));
    stats_.rays_primary += surfaces_->rays.size();
    return *surfaces_;
  }

  const RenderContext& context_;
  const PixelRect rect_;
  SampleState state_;
  bool has_history_ = false;
  std::shared_ptr<const FrameGeometry> geometry_;
  std::shared_ptr<const TileSurfaces> surfaces_;
  std::unique_ptr<TileFrameRenderer> renderer_;  ///< of the frame that was rendered last
  RenderStats stats_;
};

}  // namespace

Result<RenderStats> run_tile(const RenderContext& context, const TileRun& run,
                             std::span<const StatePtr> previous, const TileRunSink& sink,
                             std::stop_token stop) {
  const double start = thread_cpu_seconds();
  BATON_TRY(check_previous(context, run, previous));
  const bool shares = shares_history(context.job);
  TileWalk walk(context, run);
  if (!shares && !previous.empty()) walk.go_on_from(*previous.front());

  // Frame by frame.
  for (std::int32_t f = run.first_frame; f <= run.last_frame; ++f) {
    if (stop.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
    const FrameSpec& frame = context.frames[static_cast<std::size_t>(f)];
    BATON_ASSIGN(const FilmTile film,
                 shares ? walk.render_sharing(frame, previous) : walk.render_still(frame));
    BATON_TRY(sink.film(f, film));
    if (sink.diagnostics) sink.diagnostics({f, run.tile, walk.frame_sampling()});
    if (context.job.visibility.correlated) BATON_TRY(sink.samples(walk.take_first_pass()));
  }
  if (carries_state(context.job)) BATON_TRY(sink.state(walk.take_state()));

  RenderStats stats = walk.stats();
  stats.cpu_seconds += thread_cpu_seconds() - start;
  return stats;
}

}  // namespace baton
