#include "worker/pass/tile_frame.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

#include "common/base/poison.h"
#include "common/job/aov.h"
#include "common/job/plan/sequence.h"
#include "worker/light/carried_light.h"
#include "worker/method/populations.h"
#include "worker/pass/cpu_clock.h"
#include "worker/pass/pixel_books.h"

namespace baton {
namespace {

/// Prefetches what a pixel remembers: the memories of a tile are larger than the caches.
void fetch_ahead(const PixelMemory* memory) {
  if (memory == nullptr) return;
  const auto* bytes = reinterpret_cast<const std::byte*>(memory);
  for (std::size_t at = 0; at < sizeof(PixelMemory); at += 64) __builtin_prefetch(bytes + at);
}

}  // namespace

/// The pixels in work: slots [first, first + count) of the round, with what one pass hands to the
/// next.
struct TileFrameRenderer::Batch {
  std::size_t first = 0;
  std::size_t count = 0;
  FrameNumber frame{};
  Round round{};
  std::int32_t round_of_frame = 0;
  std::int32_t rounds_before = 0;  ///< TileRound::rounds_before
  RayBatch rays;
  std::array<std::size_t, kBatchPixels> end_ray;  ///< where each pixel's rays end
  std::array<KnownLight, kBatchPixels> known;
  std::array<PixelResult, kBatchPixels> pixels;
  std::array<Rgb, kBatchPixels> emission;              ///< emission of what pixels see
  std::array<std::optional<Rgb>, kBatchPixels> again;  ///< radiance once more, where it is wanted

  RngKey key(const RenderContext& context, const PixelRect& rect, std::size_t index) const {
    const auto [x, y] = rect.place(index);
    return pixel_key(context.job.seed, frame.value(), context.job.image.width, x, y,
                     round_of_frame);
  }
  bool is_probe(const RenderContext& context, const PixelRect& rect, std::size_t index) const {
    const auto [x, y] = rect.place(index);
    return baton::is_probe(x, y, frame, context.job.seed);
  }
};

TileFrameRenderer::TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry)
    : context_(context),
      geometry_(geometry),
      draws_twice_(draws_twice(context.job)),
      wants_unshadowed_(has_aov(context.job, Aov::unshadowed) ||
                        has_aov(context.job, Aov::blocked)),
      scratch_(std::make_unique<SamplerScratch>()),
      collector_(context.job) {}

void TileFrameRenderer::begin_round(const SampleState& state, Reprojection* history,
                                    bool has_history) {
  reprojection_ = history;
  has_history_ = has_history && history == nullptr;
  // The targets of the round before are there if it was rendered here.
  const std::size_t num_samples =
      state.num_pixels() * static_cast<std::size_t>(state.num_particles);
  knows_targets_ = has_history_ && targets_.size() == num_samples;
  targets_.resize(num_samples);
  if (context_.job.visibility.correlated) collector_.begin(state);
}

void TileFrameRenderer::render(const TileRound& at, SampleState& state, RoundMean& film) {
  const WorkClock clock;
  stages_ = {};
  surfaces_ = &at.surfaces;
  catchers_ = CatcherAlbedo(at.light.irradiance.get(), at.light.now);
  catchers_before_ = CatcherAlbedo(at.light.irradiance_before.get(), at.light.before);
  Batch batch;
  batch.frame = at.frame.number;
  batch.round = at.round;
  batch.round_of_frame = at.frame.round_of_frame(at.round);
  batch.rounds_before = at.rounds_before(context_.job.quality.rounds);
  round_sampling_ = {};
  const std::size_t num_pixels = at.surfaces.pixels.size();
  const std::uint64_t rays_before = reprojection_ != nullptr ? reprojection_->num_rays() : 0;
  for (std::size_t first = 0; first < num_pixels; first += kBatchPixels) {
    batch.first = first;
    batch.count = std::min(kBatchPixels, num_pixels - first);
    batch.pixels.fill({});
    if (reprojection_ != nullptr) {
      const StageTimer timer(stages_.reproject);
      reprojection_->look_up(at.surfaces, batch.first, batch.count, at.frame);
    }
    sample(batch, at, state);
    trace(batch);
    learn(batch, state);
    finish(batch, at.light, film);
  }
  state.step = at.frame.step;
  if (reprojection_ != nullptr) stats_.rays_primary += reprojection_->num_rays() - rays_before;
  if (at.round == Round(0)) stats_.pixels += num_pixels;
  if (at.round >= Round(0)) {
    frame_sampling_.merge(round_sampling_);
    stats_.sampling.merge(round_sampling_);
  }
  const double share = clock.running_share();
  stats_.seconds_primary += share * stages_.reproject;
  stats_.seconds_sample += share * stages_.sample;
  stats_.seconds_visibility += share * stages_.visibility;
  stats_.seconds_shade += share * stages_.shade;
}

/// The setting of the material of the first surface, or the job's.
const PixelMethod& TileFrameRenderer::method_of(std::size_t slot) const {
  const auto& own = context_.own_methods[surfaces_->first_surface(slot).material];
  return own != nullptr ? *own : *context_.method;
}

/// What the pixel in `slot` starts from: its samples in `state` become those of the frame before,
/// where they are not already, and the memory is asked for what evaluating them will read.
void TileFrameRenderer::look_ahead(std::size_t pixel_of_batch, std::size_t slot,
                                   const kernels::CarriedLight& light, SampleState& state) {
  if (!surfaces_->sees_surface(slot)) return;
  const std::size_t index = surfaces_->pixels.index(slot);
  Ahead& ahead = ahead_[slot % 2];
  poison(ahead.located);
  poison(ahead.old);
  fetch_ahead(state.memory_of(index));
  const bool sees_catcher = surfaces_->first_surface(slot).is_catcher;
  const bool was_seen = has_history_ && takes_up(sees_catcher, state, index);
  ahead.history = was_seen ? PixelHistory::same : PixelHistory::none;
  if (reprojection_ != nullptr) {
    ahead.history = reprojection_->take(pixel_of_batch, index, catchers_before_, state, ahead.old);
  }
  if (sees_catcher && ahead.history == PixelHistory::same && is_catcher_new())
    ahead.history = give_old_albedo(surfaces_->pixel(slot), ahead.old);
  ahead.is_located =
      ahead.history != PixelHistory::none &&
      method_of(slot).look_ahead(light, knows_targets_, {state, index}, ahead.located);
}

/// Whether catchers that stay have another albedo than in the frame before.
bool TileFrameRenderer::is_catcher_new() const {
  return catchers_before_.is_known() && !catchers_.is_like(catchers_before_);
}

/// Surfaces that stay, with the albedo of the frame before.
PixelHistory TileFrameRenderer::give_old_albedo(std::span<const SurfaceHit> hits,
                                                OldSurfaces& old) {
  gather_sites(geometry_, hits, {}, old.sites, catchers_before_);
  old.log_share.fill(0);
  return PixelHistory::moved;
}

/// Pass: what every pixel's method knows of it, and the rays that tell the rest.
void TileFrameRenderer::sample(Batch& batch, const TileRound& at, SampleState& state) {
  const StageTimer timer(stages_.sample);
  const FrameLight& light = at.light;
  const EnvironmentView now = view_of(light.now);
  const EnvironmentView before = view_of(light.before);
  const auto populations = static_cast<std::size_t>(state.num_populations);
  SiteBlock sites;
  batch.rays.clear();
  poison(batch.end_ray);
  batch.known.fill({});
  batch.emission.fill({});
  batch.again.fill({});
  const kernels::CarriedLight carried{before, now, light.still, light.presampled->sets.front()};
  look_ahead(0, batch.first, carried, state);
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::size_t slot = batch.first + i, index = surfaces_->pixels.index(slot);
    if (i + 1 < batch.count) look_ahead(i + 1, slot + 1, carried, state);

    // Gather the pixel's surfaces.
    if (!surfaces_->sees_surface(slot)) {
      // Other rounds, whose sites are elsewhere, may have seen something.
      if (batch.round <= Round(0) && !has_history_) set_background(state, index);
      if (batch.round == Round(0)) ++stats_.pixels_background;
      batch.end_ray[i] = batch.rays.size();
      continue;
    }
    poison(sites);
    batch.emission[i] = gather_sites(geometry_, surfaces_->pixel(slot),
                                     surfaces_->pixel_looks(slot), sites, catchers_);
    record_geometry(surfaces_->pixel(slot), batch.pixels[i]);  // while it is in the cache

    // Sample it.
    const Ahead& ahead = ahead_[slot % 2];
    const auto [x, y] = surfaces_->rect.place(index);
    const PixelInput input{
        .sites = sites,
        .light = light,
        .presampled = light.presampled->of(x, y),
        .now = now,
        .before = before,
        .key = batch.key(context_, surfaces_->rect, index),
        .rounds_before = batch.rounds_before,
        .has_history = ahead.history != PixelHistory::none,
        .target_before = knows_targets_ ? targets_of(index, state) : std::span<float>(),
        .old = ahead.history == PixelHistory::moved ? &ahead.old : nullptr,
        .located = ahead.is_located ? std::span(ahead.located).first(populations)
                                    : std::span<const kernels::LocatedDirections>(),
        .target = targets_of(index, state),
        .neighbors = reprojection_ != nullptr ? reprojection_->neighbors(i, catchers_before_)
                                              : std::span<const CarriedSet>(),
        .hits = surfaces_->pixel(slot),
        .geometry = &geometry_,
        .wants_unshadowed = wants_unshadowed_};
    const SiteOrigins from = origins(slot);
    const bool is_catcher = surfaces_->first_surface(slot).is_catcher;
    if (is_catcher && has_history_ && belongs_to_object(state, index)) {
      batch.pixels[i].shadow = sample_edge(input, light, state);
      batch.pixels[i].catcher = 1;
      batch.end_ray[i] = batch.rays.size();
      continue;
    }
    if (at.probe_light != nullptr && !is_catcher &&
        (draws_twice_ || batch.is_probe(context_, surfaces_->rect, index))) {
      batch.again[i] =
          probe_.sample_again(method_of(slot), input, *at.probe_light,
                              at.probe_light->presampled->of(x, y), state, index, from, *scratch_);
    }
    RayWriter rays(from, batch.rays);
    poison(*scratch_);
    const PixelDiagnostics did = method_of(slot).sample(input, {state, index}, *scratch_, rays);
    batch.known[i] = rays.known;
    batch.end_ray[i] = batch.rays.size();

    if (is_catcher) {
      set_catcher(state, index);
      batch.pixels[i].shadow = dark_share(input.hits, sites);
    } else if (context_.scene->has_catcher) {
      if (const float share = catcher_share(input.hits); share > 0) {
        batch.pixels[i].shadow = sample_edge(input, light, state);
        batch.pixels[i].catcher = share;
      }
    }

    // Count what the method did.
    PixelResult& pixel = batch.pixels[i];
    pixel.lns = mean_lns(state, index);
    pixel.source = latest_source(state, index);
    pixel.source_color = source_color(pixel.source);
    record_sampling(did, pixel, round_sampling_);
    stats_.target_evaluations += static_cast<std::uint64_t>(did.target_evaluations);
    stats_.rays_shadow += did.rays_traced;
  }
}

/// The sites on catchers of a pixel that belongs to an object.
Rgb TileFrameRenderer::sample_edge(const PixelInput& input, const FrameLight& light,
                                   const SampleState& state) {
  return edge_.sample(*context_.method, input, light, catchers_, state, *scratch_);
}

/// Where the shadow rays of a pixel's sites start.
SiteOrigins TileFrameRenderer::origins(std::size_t slot) const {
  const std::span<const SurfaceHit> hits = surfaces_->pixel(slot);
  SiteOrigins origins;
  origins.num_sites = static_cast<std::int32_t>(hits.size());
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) origins.set(s, hits[s].ray_origin);
  }
  return origins;
}

/// Pass: visibility of all samples of the batch at once.
void TileFrameRenderer::trace(Batch& batch) {
  const StageTimer timer(stages_.visibility);
  geometry_.accel->occluded(batch.rays.rays);
  stats_.rays_shadow += batch.rays.size();
}

/// Pass: adds the free rays of each pixel to what is known of it, and tells its method what they
/// found.
void TileFrameRenderer::learn(Batch& batch, SampleState& state) {
  const StageTimer timer(stages_.shade);
  std::size_t first = 0;
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::size_t slot = batch.first + i, index = surfaces_->pixels.index(slot);
    const std::size_t end = batch.end_ray[i], count = end - first;
    if (!surfaces_->sees_surface(slot)) continue;
    const KnownLight& known = batch.known[i];
    const FreeLight found = sum_free(batch.rays, first, end);
    PixelResult& pixel = batch.pixels[i];
    pixel.radiance = known.color + found.color;
    pixel.visibility = known.visibility + found.visibility;
    const bool all_free = static_cast<std::size_t>(std::popcount(found.is_free)) == count;
    pixel.mask = all_free && !known.blocked ? 1.0f : 0.0f;

    pixel.blocked = known.unshadowed ? *known.unshadowed - pixel.radiance : found.blocked;

    // Another draw tells the error of this one.
    pixel.variance = known.variance;
    pixel.error = kErrorUnknown;
    if (const std::optional<Rgb>& again = batch.again[i]) {
      const Rgb difference = pixel.radiance - *again;
      if (draws_twice_) pixel.variance = difference * difference * 0.5f;
      if (batch.is_probe(context_, surfaces_->rect, index))
        pixel.error = static_cast<float>(squared_error(mean(pixel.radiance), mean(*again)));
    }

    const FoundRays rays{.sample = std::span(batch.rays.sample).subspan(first, count),
                         .tag = std::span(batch.rays.tag).subspan(first, count),
                         .is_free = found.is_free};
    if (count > 0) method_of(slot).learn(rays, {state, index});
    if (context_.job.visibility.correlated) collect(rays, index, state);
    first = end;
  }
}

/// Keeps what the second pass needs of a pixel.
void TileFrameRenderer::collect(const FoundRays& found, std::size_t index,
                                const SampleState& state) {
  const std::size_t first = index * static_cast<std::size_t>(state.num_particles);
  for (std::size_t i = 0; i < found.sample.size(); ++i)
    collector_.add_ray(state, first + found.sample[i], !found.free(i));
}

/// Pass: adds what is not sampled and hands the pixels on.
void TileFrameRenderer::finish(Batch& batch, const FrameLight& light, RoundMean& film) {
  const StageTimer timer(stages_.shade);
  const bool show_environment = context_.job.output.background == Background::environment;
  std::array<Rgb, kBatchPixels> background{};
  if (show_environment) {
    const EnvironmentView seen = view_of(light.seen);
    EnvironmentBehind behind(seen, background);
    for (std::size_t i = 0; i < batch.count; ++i)
      behind.add(i, surfaces_->pixel(batch.first + i), surfaces_->pixel_rays(batch.first + i));
    behind.flush();
  }
  for (std::size_t i = 0; i < batch.count; ++i) {
    PixelResult& pixel = batch.pixels[i];
    const std::size_t slot = batch.first + i;
    if (surfaces_->sees_surface(slot) && surfaces_->first_surface(slot).is_catcher) {
      const PixelResult caught = std::exchange(pixel, {});  // which is not in the image
      pixel.shadow = caught.catcher > 0 ? caught.shadow : caught.radiance + caught.shadow;
      pixel.catcher = catcher_share(surfaces_->pixel(slot));
    }
    pixel.radiance += background[i] + batch.emission[i];
    pixel.alpha = show_environment ? 1 : pixel.coverage;
    film.add(surfaces_->pixels.index(slot), pixel, surfaces_->pixels.weight(slot));
  }
}

}  // namespace baton
