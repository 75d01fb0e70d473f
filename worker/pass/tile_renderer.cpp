#include "worker/pass/tile_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "common/base/cpu_clock.h"
#include "common/base/trace.h"
#include "common/job/motion.h"
#include "worker/pass/adaptive_rounds.h"
#include "worker/pass/fine_sites.h"
#include "worker/pass/geometry_planes.h"
#include "worker/pass/pixel_order.h"
#include "worker/pass/sweep_mean.h"
#include "worker/pass/tile_frame.h"

namespace baton {
namespace {

/// A state must be that of the job, a tile and a step.
Status check_state(const RenderContext& context, const SampleState& state, std::int32_t tile,
                   Step step) {
  if (state.picture != context.picture) {
    return Error{ErrorKind::bad_input, fmt::format("sample state: of picture {}, expected {}",
                                                   state.picture.hex(), context.picture.hex())};
  }
  const std::int32_t num_particles = num_carried_particles(context.job.sampling);
  if (state.tile != tile || state.step != step || state.rect != context.grid.rect(tile) ||
      state.num_particles != num_particles ||
      state.num_populations != num_populations(context.job)) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("sample state: of tile {} frame index {} with {} particles, expected {}, "
                    "{}, {}",
                    state.tile, state.step, state.num_particles, tile, step, num_particles)};
  }
  return {};
}

/// The states must be exactly those that come before the run.
Status check_previous(const RenderContext& context, const TileRun& run,
                      std::span<const StatePtr> previous) {
  std::vector<std::int32_t> tiles;
  if (carries_state(context.job) && run.steps.first > Step(0))
    tiles = context.grid.tiles_near(run.tile, history_reach_px(context.job));
  if (previous.size() != tiles.size()) {
    return Error{ErrorKind::internal,
                 fmt::format("tile {} frame index {}: got {} previous states, expected {}",
                             run.tile, run.steps.first, previous.size(), tiles.size())};
  }
  for (std::size_t i = 0; i < tiles.size(); ++i)
    BATON_TRY(check_state(context, *previous[i], tiles[i], run.steps.first - 1));
  return {};
}

/// What sites see takes 120 bytes each, which their pixels' methods read soon after.
constexpr std::size_t kSitesInCache = 4096;

/// The pixels of a preroll round: one of each square of kPrerollSide, in each round another.
RoundPixels preroll_pixels(const PixelRect& rect, Round round) {
  constexpr std::int32_t kTurn[] = {0, 3, 1, 2}, kLast = kPrerollSide - 1;
  static_assert(std::size(kTurn) == std::size_t{kPrerollSide} * kPrerollSide);
  const std::int32_t turn = kTurn[static_cast<std::size_t>(-round.value()) % std::size(kTurn)];
  RoundPixels pixels;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rect.area()); ++i) {
    const auto [x, y] = rect.place(i);
    if ((x & kLast) + kPrerollSide * (y & kLast) == turn) pixels.add(i, 1);
  }
  return pixels;
}

/// Pixels of a round that are traced together.
struct RoundPart {
  RoundPixels pixels;
  PixelOrder order;
};

/// A tile on its way through its frames, round by round.
class TileWalk {
 public:
  TileWalk(const RenderContext& context, const TileRun& run, const std::stop_token& stop)
      : context_(context),
        rect_(context.grid.rect(run.tile)),
        shares_(shares_history(context.job)),
        keeps_surfaces_(!shares_ && run.steps.size() > 1),
        stop_(stop) {
    start_state();
    state_.picture = context.picture;
    state_.tile = run.tile;
  }

  /// Where surfaces stay: what the tile itself left goes on.
  void go_on_from(const SampleState& previous) {
    state_ = previous;
    has_history_ = true;
  }

  /// Renders the next frame. previous: where surfaces move, the states of all tiles that its
  /// history may come from, or none.
  Result<FilmTile> render(const FrameSpec& frame, std::span<const StatePtr> previous) {
    BATON_TRY(prepare(frame));
    RoundMean film(context_.job, rect_);
    AdaptiveRounds adaptive(context_.job, rect_);
    GeometryPlanes planes(context_, frame, *geometry_, rect_);
    renderer_->begin_frame();
    const Round first(frame.step == Step(0) ? -num_preroll_rounds(context_.job) : 0);
    std::optional<RoundMean> unseen;
    if (first < Round(0)) unseen.emplace(context_.job, rect_);
    std::shared_ptr<const FrameLight> probe_light;
    if (tells_noise(context_.job) && context_.job.quality.rounds == 1) {
      BATON_ASSIGN(probe_light, light_of(frame, kProbeRound));
    }
    for (Round round = first; round < Round(context_.job.quality.rounds); ++round) {
      if (stop_.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
      if (round == Round(limits::kJudgingRounds)) adaptive.judge(film);
      RoundPixels pixels = round < Round(0) ? preroll_pixels(rect_, round) : adaptive.pixels(round);
      if (round >= Round(0) && pixels.size() == 0) break;
      BATON_ASSIGN(const std::shared_ptr<const FrameLight> light, light_of(frame, round));
      const bool is_seen = round >= Round(0);
      RoundMean& mean = !is_seen ? *unseen : film;
      std::optional<Reprojection> history;
      if (shares_ && round == first) history.emplace(context_, *geometry_, *before_, previous);
      const auto whole = kept_surfaces(frame.round_of_frame(round), history.has_value());
      if (history && whole != nullptr) keep_for_next(frame, whole);
      const bool goes_on = has_history_ && !history;
      renderer_->begin_round(state_, goes_on);
      for (RoundPart& part : parts_of(std::move(pixels), whole != nullptr)) {
        const auto surfaces =
            surfaces_of(frame.round_of_frame(round), std::move(part.pixels), whole);
        if (is_seen) planes.add(*surfaces);
        renderer_->render({.frame = frame,
                           .round = round,
                           .light = *light,
                           .surfaces = *surfaces,
                           .order = part.order,
                           .probe_light = is_seen ? probe_light.get() : nullptr,
                           .history = history ? &*history : nullptr,
                           .goes_on = goes_on},
                          state_, mean);
      }
      has_history_ = carries_state(context_.job);
    }
    FilmTile result = film.finish();
    planes.write(result);
    return result;
  }

  /// At the end of the walk.
  SampleState take_state() { return std::move(state_); }
  /// Statistics of the frame that was rendered last.
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
    state_.resize(*context_.method.format, rect_, num_carried_particles(context_.job.sampling),
                  num_populations(context_.job));
  }
  /// Where surfaces move, a frame has a geometry, surfaces and a state of its own.
  Status prepare(const FrameSpec& frame) {
    if (renderer_ != nullptr && !shares_) return {};
    BATON_ASSIGN(geometry_, context_.geometry->at(frame.step));
    if (shares_) {
      BATON_ASSIGN(before_, context_.geometry->at(std::max(frame.step - 1, Step(0))));
      start_state();
      if (renderer_ != nullptr) stats_.merge(renderer_->stats());
    }
    kept_.clear();
    count_tile_sites();
    renderer_ = std::make_unique<TileFrameRenderer>(context_, *geometry_);
    return {};
  }
  /// Where geometry is fine, pixels have numbers of sites of their own.
  void count_tile_sites() {
    num_tile_sites_ = state_.num_pixels() * static_cast<std::size_t>(context_.job.image.sites);
    if (!has_fine_sites(context_.job)) return;
    const CpuTimer timer(stats_.seconds_primary);
    std::vector<PixelPlace> pixels;
    for (std::size_t i = 0; i < state_.num_pixels(); ++i) pixels.push_back(rect_.place(i));
    counts_ = count_sites(context_.job, *geometry_, pixels);
    stats_.rays_primary += limits::kGeometryProbes * pixels.size();
    num_tile_sites_ = std::accumulate(counts_.begin(), counts_.end(), std::size_t{0});
  }
  bool is_one_part() const { return counts_.empty() || num_tile_sites_ <= limits::kMaxSitesAtOnce; }
  std::size_t num_sites(std::size_t index) const {
    return counts_.empty() ? static_cast<std::size_t>(context_.job.image.sites) : counts_[index];
  }
  /// The pixels of a round, as many whole batches at a time as caches have room for; all together
  /// where these are kept.
  std::vector<RoundPart> parts_of(RoundPixels pixels, bool are_kept) const {
    std::vector<RoundPart> parts;
    using Blocks = PixelOrder::Blocks;
    const Blocks by = context_.job.light.bounces > 0 ? Blocks::of_bounces
                      : state_.block_planes.empty()  ? Blocks::none
                                                     : Blocks::of_memory;
    if (are_kept && pixels.are_all(state_.num_pixels())) {
      PixelOrder order(rect_, pixels, by, PixelBatch::kMost);
      parts.push_back({std::move(pixels), std::move(order)});
      return parts;
    }
    const PixelOrder order(rect_, pixels, by, PixelOrder::block_pixels(by));
    std::size_t room = 0;
    for (std::size_t i = 0; i < order.num_batches(); ++i) {
      const std::span<const std::uint32_t> batch = order.batch(i);
      std::size_t sites = 0;
      for (const std::uint32_t slot : batch) sites += num_sites(pixels.index(slot));
      if (sites > room) {
        parts.push_back({{}, PixelOrder(PixelBatch::kMost)});
        room = std::max(sites, kSitesInCache);
      }
      for (const std::uint32_t slot : batch)
        parts.back().pixels.add(pixels.index(slot), pixels.weight(slot));
      parts.back().order.append(batch.size());
      room -= sites;
    }
    return parts;
  }
  Result<std::shared_ptr<const FrameLight>> light_of(const FrameSpec& frame, Round round) {
    const CpuTimer timer(stats_.seconds_light);
    return context_.lights->at(frame.step, round);
  }
  /// The round of the frame whose sites a round of it has.
  std::int32_t sites_of(std::int32_t round_of_frame) const {
    return rounds_have_own_sites(context_.job) ? std::max(round_of_frame, 0) : 0;
  }
  /// What the whole tile sees in a round of the frame, if that is kept: for the rounds and frames
  /// after it, or for the next frame's history. Else null.
  std::shared_ptr<const TileSurfaces> kept_surfaces(std::int32_t round_of_frame, bool for_history) {
    const std::int32_t of = sites_of(round_of_frame);
    const auto found = kept_.find(of);
    if (found != kept_.end()) return found->second;
    if (!(is_one_part() && (of == 0 || for_history)) && !has_room()) return nullptr;
    auto whole = std::make_shared<TileSurfaces>();
    trace(of, RoundPixels::all(state_.num_pixels()), *whole);
    return kept_.emplace(of, std::move(whole)).first->second;
  }
  /// What some pixels see: of `whole`, or, where that is null, traced, until the next call.
  std::shared_ptr<const TileSurfaces> surfaces_of(
      std::int32_t round_of_frame, RoundPixels pixels,
      const std::shared_ptr<const TileSurfaces>& whole) {
    if (whole != nullptr && pixels.are_all(state_.num_pixels())) return whole;
    if (whole == nullptr) {
      trace(sites_of(round_of_frame), std::move(pixels), *passing_);
    } else {
      const CpuTimer timer(stats_.seconds_primary);
      *passing_ = part_of(*whole, std::move(pixels));
    }
    return passing_;
  }
  /// Tiles ask for what those of the frame before saw; one that is behind them traces it again. Of
  /// a tile in parts nothing is kept.
  void keep_for_next(const FrameSpec& frame, const std::shared_ptr<const TileSurfaces>& surfaces) {
    context_.surfaces->release_before(frame.step - 1);
    if (is_one_part()) context_.surfaces->keep({frame.step, state_.tile}, frame.step, surfaces);
  }
  /// For what another round sees, until the next frame.
  bool has_room() const {
    const std::size_t of_round =
        TileSurfaces::size_bytes(num_tile_sites_, context_.scene->has_detail);
    return keeps_surfaces_ && (kept_.size() + 1) * of_round <= limits::kMaxRoundSurfaceBytes;
  }
  void trace(std::int32_t round, RoundPixels pixels, TileSurfaces& surfaces) {
    const CpuTimer timer(stats_.seconds_primary);
    trace_primary(context_.job, *geometry_, rect_, std::move(pixels), round, counts_, surfaces);
    stats_.rays_primary += surfaces.rays.size();
  }

  const RenderContext& context_;
  const PixelRect rect_;
  const bool shares_;  ///< pixels take history from others
  const bool keeps_surfaces_;
  const std::stop_token stop_;
  SampleState state_;
  bool has_history_ = false;
  std::shared_ptr<const FrameGeometry> geometry_, before_;
  std::vector<std::uint16_t> counts_;  ///< S of each pixel; empty: image.sites
  std::size_t num_tile_sites_ = 0;     ///< sites of all pixels
  std::map<std::int32_t, std::shared_ptr<const TileSurfaces>> kept_;  ///< by round
  /// Surfaces of a part of the tile, which are not kept.
  std::shared_ptr<TileSurfaces> passing_ = std::make_shared<TileSurfaces>();
  std::unique_ptr<TileFrameRenderer> renderer_;
  RenderStats stats_;
};

}  // namespace

Result<RenderStats> run_tile(const RenderContext& context, const TileRun& run,
                             std::span<const StatePtr> previous, const TileRunSink& sink,
                             const std::stop_token& stop) {
  const double start = thread_cpu_seconds();
  BATON_TRY(check_previous(context, run, previous));
  const bool shares = shares_history(context.job);
  const Timeline timeline(context.job);
  TileWalk walk(context, run, stop);
  if (!shares && !previous.empty()) walk.go_on_from(*previous.front());

  // Frame by frame.
  for (Step step = run.steps.first; step <= run.steps.last; ++step) {
    if (stop.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
    const FrameSpec& frame = context.frames[step.index()];
    Span span(SpanKind::frame, fmt::format("frame {}", frame.number));
    span.add("step", step.value());
    BATON_ASSIGN(FilmTile film, walk.render(frame, previous));
    if (const Sweep sweep = timeline.sweep_of(step); sweep > Sweep(0)) {
      const Step earlier_step = timeline.step_of(timeline.frame_of(step), sweep - 1);
      BATON_ASSIGN(FilmTile earlier, sink.earlier_film(earlier_step));
      BATON_TRY(add_sweeps(std::move(earlier), sweep, film));
    }
    BATON_TRY(sink.film(step, film));
    if (sink.diagnostics) sink.diagnostics({step.value(), run.tile, walk.frame_sampling()});
    if (context.job.visibility.correlated) BATON_TRY(sink.samples(walk.take_first_pass()));
  }
  if (carries_state(context.job)) BATON_TRY(sink.state(walk.take_state()));

  RenderStats stats = walk.stats();
  stats.cpu_seconds += thread_cpu_seconds() - start;
  return stats;
}

}  // namespace baton
