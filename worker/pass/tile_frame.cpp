#include "worker/pass/tile_frame.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/cpu_clock.h"
#include "common/base/poison.h"
#include "common/job/aov.h"
#include "worker/pass/pixel_books.h"

namespace baton {
namespace {

/// Where the shadow rays of a pixel's sites start.
SiteOrigins origins_of(std::span<const SurfaceHit> hits) {
  SiteOrigins origins;
  origins.num_sites = static_cast<std::int32_t>(hits.size());
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) origins.set(s, hits[s].ray_origin);
  }
  return origins;
}

}  // namespace

TileFrameRenderer::TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry)
    : context_(context),
      geometry_(geometry),
      draws_twice_(draws_twice(context.job)),
      wants_unshadowed_(has_aov(context.job, Aov::unshadowed) ||
                        has_aov(context.job, Aov::blocked)),
      sampler_(context.method.start()),
      collector_(context.job) {
  if (context.job.light.bounces > 0) bounces_.emplace(context.job.light, geometry);
  for (const PixelMethod& own : context.own_methods)
    own_samplers_.push_back(own.start ? own.start() : nullptr);
}

void TileFrameRenderer::begin_round(const SampleState& state, bool goes_on) {
  sampler_->begin_round(state, goes_on);
  for (const auto& own : own_samplers_) {
    if (own != nullptr) own->begin_round(state, goes_on);
  }
  if (context_.job.visibility.correlated) collector_.begin(state);
}

void TileFrameRenderer::render(const TileRound& at, SampleState& state, RoundMean& film) {
  const WorkClock clock;
  const std::size_t num_pixels = at.surfaces.pixels.size();
  const std::uint64_t rays_before = at.history != nullptr ? at.history->num_rays() : 0;
  RoundWork work(context_, at);
  PixelStarts starts(geometry_, work);
  PixelBatch batch;
  for (std::size_t i = 0; i < at.order.num_batches(); ++i) {
    batch.begin(at.order.batch(i));
    starts.begin(batch, state);
    sample(work, starts, state, batch);
    trace(work, batch);
    bounce(work, batch);
    shade(work, state, batch);
    show(work, batch, film);
  }
  state.step = at.frame.step;

  // Count.
  if (at.history != nullptr) stats_.rays_primary += at.history->num_rays() - rays_before;
  if (at.round == Round(0)) stats_.pixels += num_pixels;
  if (at.round >= Round(0)) {
    frame_sampling_.merge(work.sampling);
    stats_.sampling.merge(work.sampling);
  }
  const double share = clock.running_share();
  stats_.seconds_primary += share * work.seconds.history;
  stats_.seconds_sample += share * work.seconds.sample;
  stats_.seconds_visibility += share * work.seconds.trace;
  stats_.seconds_shade += share * work.seconds.shade;
}

const PixelMethod& TileFrameRenderer::method_of(const TileSurfaces& surfaces,
                                                std::size_t slot) const {
  const PixelMethod& own = context_.own_methods[surfaces.first_surface(slot).material];
  return own.start ? own : context_.method;
}

TileSampler& TileFrameRenderer::sampler_of(const TileSurfaces& surfaces, std::size_t slot) const {
  const auto& own = own_samplers_[surfaces.first_surface(slot).material];
  return own != nullptr ? *own : *sampler_;
}

/// What every pixel's method knows of it, and the rays that tell the rest.
void TileFrameRenderer::sample(RoundWork& work, PixelStarts& starts, SampleState& state,
                               PixelBatch& batch) {
  const StageTimer timer(work.seconds.sample);
  const TileSurfaces& surfaces = work.at.surfaces;
  const auto look_ahead = [&](std::size_t i) {
    const std::size_t slot = batch.slots[i];
    if (!surfaces.sees_surface(slot)) return;
    const bool has_history = starts.find(i, slot, state);
    sampler_of(surfaces, slot)
        .look_ahead(work.light, has_history,
                    {state, surfaces.pixels.index(slot), surfaces.sees_catcher(slot)});
  };
  note_again(work, batch);
  SiteBlock sites;
  look_ahead(0);
  for (std::size_t i = 0; i < batch.count(); ++i) {
    const std::size_t slot = batch.slots[i], index = surfaces.pixels.index(slot);
    if (i + 1 < batch.count()) look_ahead(i + 1);
    if (surfaces.sees_surface(slot)) {
      poison(sites);
      batch.emission[i] = gather_sites(geometry_, surfaces.pixel(slot),
                                       surfaces.pixel_shadings(slot), sites, work.catchers);
      record_geometry(surfaces.pixel(slot), batch.pixels[i]);  // while it is in the cache
      const auto [x, y] = surfaces.rect.place(index);
      sample_pixel(work,
                   {.sites = sites,
                    .light = work.light,
                    .presampled = work.light.frame.presampled->of(x, y),
                    .key = work.key(index),
                    .rounds_before = work.at.rounds_before(context_.job.quality.rounds),
                    .start = starts.of(i),
                    .hits = surfaces.pixel(slot),
                    .geometry = &geometry_,
                    .wants_unshadowed = wants_unshadowed_},
                   i, {state, index, surfaces.sees_catcher(slot)}, batch);
    } else {
      see_nothing(work, slot, state);
    }
    batch.end_ray[i] = batch.rays.size();
  }
}

void TileFrameRenderer::see_nothing(const RoundWork& work, std::size_t slot, SampleState& state) {
  // Other rounds, whose sites are elsewhere, may have seen something.
  if (work.at.round <= Round(0) && !work.at.goes_on)
    state.set_source(work.at.surfaces.pixels.index(slot), PixelSource::background);
  if (work.at.round == Round(0)) ++stats_.pixels_background;
}

void TileFrameRenderer::sample_pixel(RoundWork& work, const PixelInput& input, std::size_t i,
                                     const PixelState& pixel, PixelBatch& batch) {
  const TileSurfaces& surfaces = work.at.surfaces;
  const std::size_t slot = batch.slots[i];
  PixelResult& result = batch.pixels[i];
  const auto sample_edge = [&] {
    const Rgb arrives = edge_.sample(context_.method, input, work.catchers, pixel);
    start_bounces(work, edge_.start(input), PixelBatch::kOnEdge + i, pixel.index, true);
    return arrives;
  };
  if (pixel.sees_catcher && work.at.goes_on && belongs_to_object(pixel.tile, pixel.index)) {
    result.shadow = sample_edge();
    result.catcher = 1;
    return;
  }

  const SiteOrigins origins = origins_of(input.hits);
  if (!pixel.sees_catcher) sample_again(work, input, i, pixel, origins, batch);
  RayWriter rays(origins, batch.rays);
  const PixelDiagnostics did = sampler_of(surfaces, slot).sample(input, pixel, rays);
  batch.known[i] = rays.known;
  if (pixel.sees_catcher) {
    pixel.tile.set_source(pixel.index, PixelSource::catcher);
    result.shadow = dark_share(input.hits, input.sites);
  } else if (context_.scene->has_catcher) {
    if (const float share = catcher_share(input.hits); share > 0) {
      result.shadow = sample_edge();
      result.catcher = share;
    }
  }

  start_bounces(work, {input.sites, input.hits, input.presampled, input.key}, i, pixel.index,
                pixel.sees_catcher);
  if (!pixel.sees_catcher) start_bounces_again(work, input, i, pixel.index, batch);

  // Count what the method did.
  result.lns = did.lns;
  result.source = pixel.tile.latest_source(pixel.index);
  result.source_color = source_color(result.source);
  record_sampling(did, result, work.sampling);
  stats_.target_evaluations += static_cast<std::uint64_t>(did.target_evaluations);
  stats_.rays_shadow += did.rays_traced;
}

/// Who is drawn again is so with all whose light it shares.
void TileFrameRenderer::note_again(const RoundWork& work, PixelBatch& batch) const {
  if (!bounces_ || !work.probe_light) return;
  for (const std::uint32_t slot : batch.slots) {
    const std::size_t index = work.at.surfaces.pixels.index(slot);
    if (!is_drawn_again(work, index) || work.at.surfaces.sees_catcher(slot)) continue;
    const BounceGroup group = work.group(index);
    if (!batch.has_again(group)) batch.groups_again.push_back(group);
  }
}

/// Paths from sites of a pixel, which add to `number` of PixelBatch::indirect. Those of catchers
/// share with others, so that objects are as without them.
void TileFrameRenderer::start_bounces(const RoundWork& work, BounceStart start, std::size_t number,
                                      std::size_t index, bool on_catchers) {
  if (!bounces_ || work.at.round < Round(0)) return;
  start.group = work.group(index);
  if (on_catchers) start.group.number += BounceGroup::kOfBlock;
  bounces_->add(static_cast<std::uint32_t>(number), start);
}

/// Those of the other draw of a pixel, where somebody of its group has one.
void TileFrameRenderer::start_bounces_again(const RoundWork& work, const PixelInput& input,
                                            std::size_t i, std::size_t index,
                                            const PixelBatch& batch) {
  if (batch.groups_again.empty() || !batch.has_again(work.group(index))) return;
  const auto [x, y] = work.at.surfaces.rect.place(index);
  start_bounces(work,
                {.sites = input.sites,
                 .hits = input.hits,
                 .presampled = work.probe_light->frame.presampled->of(x, y),
                 .key = probe_key(input.key),
                 .is_aside = true},
                PixelBatch::kAgain + i, index, false);
}

/// Another draw of the pixel, where its error is to be told.
void TileFrameRenderer::sample_again(RoundWork& work, const PixelInput& input, std::size_t i,
                                     const PixelState& pixel, const SiteOrigins& origins,
                                     PixelBatch& batch) {
  if (!is_drawn_again(work, pixel.index)) return;
  const auto [x, y] = work.at.surfaces.rect.place(pixel.index);
  batch.again[i] =
      probe_.sample_again(method_of(work.at.surfaces, batch.slots[i]), input, *work.probe_light,
                          work.probe_light->frame.presampled->of(x, y), pixel, origins);
}

/// Visibility of all samples of the batch at once.
void TileFrameRenderer::trace(RoundWork& work, PixelBatch& batch) {
  const StageTimer timer(work.seconds.trace);
  geometry_.accel->occluded(batch.rays.rays);
  stats_.rays_shadow += batch.rays.size();
}

/// Follows the paths of the batch, which its sites have begun.
void TileFrameRenderer::bounce(RoundWork& work, PixelBatch& batch) {
  if (!bounces_) return;
  const StageTimer timer(work.seconds.trace);
  const std::uint64_t rays_before = bounces_->num_rays();
  bounces_->follow(work.light.now, batch.indirect);
  stats_.rays_shadow += bounces_->num_rays() - rays_before;
}

/// Adds the free rays of each pixel to what is known of it, and tells its method and the second
/// pass what they found.
void TileFrameRenderer::shade(RoundWork& work, SampleState& state, PixelBatch& batch) {
  const StageTimer timer(work.seconds.shade);
  const TileSurfaces& surfaces = work.at.surfaces;
  std::size_t first = 0;
  for (std::size_t i = 0; i < batch.count(); ++i) {
    const std::size_t slot = batch.slots[i], index = surfaces.pixels.index(slot);
    const std::size_t end = batch.end_ray[i], count = end - first;
    if (!surfaces.sees_surface(slot)) continue;
    const KnownLight& known = batch.known[i];
    const FreeLight found = sum_free(batch.rays, first, end);
    PixelResult& pixel = batch.pixels[i];
    pixel.radiance = known.color + found.color;
    pixel.visibility = known.visibility + found.visibility;
    const bool all_free = static_cast<std::size_t>(std::popcount(found.is_free)) == count;
    pixel.mask = all_free && !known.blocked ? 1.0f : 0.0f;
    pixel.blocked = known.unshadowed ? *known.unshadowed - pixel.radiance : found.blocked;
    pixel.indirect = batch.indirect[i];
    if (bounces_ && work.at.round >= Round(0) && !surfaces.sees_catcher(slot)) {
      stats_.light.direct += double{luminance(pixel.radiance)};
      stats_.light.indirect += double{luminance(pixel.indirect)};
    }
    pixel.radiance += pixel.indirect;
    pixel.shadow += batch.indirect[PixelBatch::kOnEdge + i];

    // Another draw tells the error of this one.
    pixel.variance = known.variance;
    pixel.error = kErrorUnknown;
    if (batch.again[i]) {
      const Rgb again = *batch.again[i] + batch.indirect[PixelBatch::kAgain + i];
      const Rgb difference = pixel.radiance - again;
      if (draws_twice_) pixel.variance = difference * difference * 0.5f;
      if (work.is_probe(index))
        pixel.error = static_cast<float>(squared_error(mean(pixel.radiance), mean(again)));
    }

    const FoundRays rays{.sample = std::span(batch.rays.sample).subspan(first, count),
                         .tag = std::span(batch.rays.tag).subspan(first, count),
                         .is_free = found.is_free};
    if (count > 0)
      sampler_of(surfaces, slot).learn(rays, {state, index, surfaces.sees_catcher(slot)});
    if (context_.job.visibility.correlated) collector_.add_rays(state, index, rays);
    first = end;
  }
}

/// Adds what is not sampled and hands the pixels on.
void TileFrameRenderer::show(RoundWork& work, PixelBatch& batch, RoundMean& film) {
  const StageTimer timer(work.seconds.shade);
  const TileSurfaces& surfaces = work.at.surfaces;
  const bool show_environment = context_.job.output.background == Background::environment;
  PixelBatch::Column<Rgb> background{};
  if (show_environment) {
    const EnvironmentView seen = view_of(work.at.light.seen);
    EnvironmentBehind behind(seen, background);
    for (std::size_t i = 0; i < batch.count(); ++i)
      behind.add(i, surfaces.pixel(batch.slots[i]), surfaces.pixel_rays(batch.slots[i]));
    behind.flush();
  }
  for (std::size_t i = 0; i < batch.count(); ++i) {
    PixelResult& pixel = batch.pixels[i];
    const std::size_t slot = batch.slots[i];
    if (surfaces.sees_catcher(slot)) {
      const PixelResult caught = std::exchange(pixel, {});  // which is not in the image
      pixel.shadow = caught.catcher > 0 ? caught.shadow : caught.radiance + caught.shadow;
      pixel.catcher = catcher_share(surfaces.pixel(slot));
    }
    pixel.radiance += background[i] + batch.emission[i];
    pixel.alpha = show_environment ? 1 : pixel.coverage;
    film.add(surfaces.pixels.index(slot), pixel, surfaces.pixels.weight(slot));
  }
}

}  // namespace baton
