#include "worker/pass/tile_frame.h"

#include <algorithm>
#include <bit>

#include "common/base/poison.h"
#include "worker/integrator/reference.h"
#include "worker/pass/blocked_samples.h"
#include "worker/pass/cpu_clock.h"
#include "worker/pass/pixel_books.h"
#include "worker/sampling/light_noise.h"

namespace baton {
namespace {

/// Asks for a pixel's memory early: those of a tile are larger than the caches.
void fetch_ahead(std::span<const MemoryCell> memory) {
  constexpr std::size_t kCellsOfLine = 64 / sizeof(MemoryCell);
  for (std::size_t i = 0; i < memory.size(); i += kCellsOfLine) __builtin_prefetch(&memory[i]);
}

}  // namespace

/// The pixels in work: [first, first + count) of the tile, with what one pass hands to the next.
struct TileFrameRenderer::Batch {
  std::size_t first = 0;
  std::size_t count = 0;
  std::int32_t frame_number = 0;
  std::int32_t frame_index = 0;
  RayBatch rays;           ///< samples are numbered batch pixel * stride + number in the pixel
  std::size_t stride = 1;  ///< most rays of a pixel
  std::array<std::size_t, kBatchPixels> end_ray;           ///< where each pixel's rays end
  std::array<float, kBatchPixels> difference;              ///< as PixelRays::difference
  std::array<LightVariance, kBatchPixels> light_variance;  ///< as PixelRays::light_variance
  std::vector<std::uint8_t> bin;                           ///< as PixelRays::bin, by sample
  std::array<PixelResult, kBatchPixels> pixels;

  RngKey key(const RenderContext& context, const PixelRect& rect, std::size_t index) const {
    const auto width = static_cast<std::size_t>(rect.width());
    const auto x = rect.x0 + static_cast<std::int32_t>(index % width);
    const auto y = rect.y0 + static_cast<std::int32_t>(index / width);
    return {.job_seed = context.job.seed,
            .frame = static_cast<std::uint32_t>(frame_number),
            .pixel = static_cast<std::uint32_t>(y * context.job.image.width + x)};
  }
};

TileFrameRenderer::TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry,
                                     const TileSurfaces& surfaces)
    : context_(context),
      geometry_(geometry),
      surfaces_(surfaces),
      scratch_(std::make_unique<SamplerScratch>()),
      collector_(context.job) {
  for (std::int32_t k = 0; k < num_populations(context.job); ++k)
    picture_scale_.push_back(picture_scale(context.job, k));
}

FilmTile TileFrameRenderer::render(const FrameSpec& frame, const FrameLight& light,
                                   bool has_history, SampleState& state) {
  reprojection_ = nullptr;
  has_history_ = has_history;
  return render_batches(frame, light, state);
}

FilmTile TileFrameRenderer::render(const FrameSpec& frame, const FrameLight& light,
                                   Reprojection& history, SampleState& state) {
  reprojection_ = &history;
  const std::uint64_t rays_before = history.num_rays();
  const FilmTile film = render_batches(frame, light, state);
  stats_.rays_primary += history.num_rays() - rays_before;
  return film;
}

FilmTile TileFrameRenderer::render_batches(const FrameSpec& frame, const FrameLight& light,
                                           SampleState& state) {
  const WorkClock clock;
  stages_ = {};
  FilmWriter film(surfaces_.rect, context_.job.output.aovs);
  Batch batch;
  batch.frame_number = frame.number;
  batch.frame_index = frame.index;
  frame_sampling_ = {};
  const bool chooses_rays = context_.sampler != nullptr && context_.sampler->chooses_rays();
  batch.stride = chooses_rays ? limits::kMaxParticles
                              : static_cast<std::size_t>(std::max(
                                    state.num_particles, context_.job.sampling.num_particles));
  if (chooses_rays) batch.bin.resize(kBatchPixels * batch.stride);
  const std::size_t num_pixels = state.num_pixels();
  keep_targets(frame.index, num_pixels * static_cast<std::size_t>(state.num_particles));
  if (context_.job.visibility.correlated) collector_.begin(state);
  for (std::size_t first = 0; first < num_pixels; first += kBatchPixels) {
    batch.first = first;
    batch.count = std::min(kBatchPixels, num_pixels - first);
    batch.pixels.fill({});
    if (context_.sampler != nullptr) {
      if (reprojection_ != nullptr) {
        const StageTimer timer(stages_.reproject);
        reprojection_->look_up(surfaces_, batch.first, batch.count, frame.number);
      }
      sample(batch, light, state);
      trace(batch);
      shade(batch, state);
    } else {
      render_reference(batch, light, state);
    }
    finish(batch, light, film);
  }
  state.frame_index = frame.index;
  stats_.pixels += num_pixels;
  stats_.sampling.merge(frame_sampling_);
  const double share = clock.running_share();
  stats_.seconds_primary += share * stages_.reproject;
  stats_.seconds_sample += share * stages_.sample;
  stats_.seconds_visibility += share * stages_.visibility;
  stats_.seconds_shade += share * stages_.shade;
  return film.film();
}

/// Makes room for the targets of the frame's samples, and says whether those of the frame before
/// are there. A method that chooses its rays itself tells no targets.
void TileFrameRenderer::keep_targets(std::int32_t frame_index, std::size_t num_samples) {
  if (context_.sampler == nullptr || context_.sampler->chooses_rays()) return;
  knows_targets_ = has_history_ && reprojection_ == nullptr && targets_.size() == num_samples &&
                   targets_frame_ + 1 == frame_index;
  targets_.resize(num_samples);
  targets_frame_ = frame_index;
}

/// What pixel `index` starts from: its samples in `state` become those of the frame before, where
/// they are not already, and the memory is asked for what evaluating them will read.
void TileFrameRenderer::look_ahead(std::size_t pixel_of_batch, std::size_t index,
                                   const kernels::CarriedLight& light, SampleState& state) {
  if (!surfaces_.sees_surface(index)) return;
  Ahead& ahead = ahead_[index % 2];
  poison(ahead.located);
  poison(ahead.old);
  fetch_ahead(state.memory_of(index));
  ahead.history = has_history_ ? PixelHistory::same : PixelHistory::none;
  if (reprojection_ != nullptr) {
    ahead.history = reprojection_->take(pixel_of_batch, index, state, ahead.old);
  }
  ahead.is_located = ahead.history != PixelHistory::none && context_.sampler->evaluates_carried();
  if (!ahead.is_located) return;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::size_t n = static_cast<std::size_t>(state.num_particles) / populations;
  for (std::size_t k = 0; k < populations; ++k) {
    kernels::locate_directions(light.now, knows_targets_ || light.still ? nullptr : &light.before,
                               std::span(state.direction).subspan((index * populations + k) * n, n),
                               ahead.located[k]);
  }
}

/// Pass: every pixel's properly weighted set, and the colours and rays that follow from it.
void TileFrameRenderer::sample(Batch& batch, const FrameLight& light, SampleState& state) {
  const StageTimer timer(stages_.sample);
  const EnvironmentView now = view_of(light.now);
  const EnvironmentView before = view_of(light.before);
  const std::int32_t frame_index = batch.frame_index;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  SampleColors colors;
  SiteBlock sites;
  batch.rays.clear();
  poison(batch.bin);
  poison(batch.end_ray);
  batch.difference.fill(0);
  batch.light_variance.fill({});
  const kernels::CarriedLight carried{before, now, light.still, light.pool};
  look_ahead(0, batch.first, carried, state);
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::size_t index = batch.first + i;
    if (i + 1 < batch.count) look_ahead(i + 1, index + 1, carried, state);

    // Gather the pixel's surfaces.
    if (!surfaces_.sees_surface(index)) {
      set_background(state, index);
      ++stats_.pixels_background;
      batch.end_ray[i] = batch.rays.size();
      continue;
    }
    poison(sites);
    context_.gather_sites(surfaces_.pixel(index), sites);

    // Sample as the material of its first surface asks for, and cast the rays.
    const PixelSetting& own = context_.own_settings[surfaces_.first_surface(index).material];
    const PixelSampler& sampler = own.sampler != nullptr ? *own.sampler : *context_.sampler;
    const std::size_t n = own.sampler != nullptr ? static_cast<std::size_t>(own.num_particles)
                                                 : num_common_particles(state);
    const Ahead& ahead = ahead_[index % 2];
    const PixelInput input{
        .sites = sites,
        .light = light,
        .now = now,
        .before = before,
        .key = batch.key(context_, surfaces_.rect, index),
        .frame_index = frame_index,
        .has_history = ahead.history != PixelHistory::none,
        .target_before = knows_targets_ ? targets_of(index, state) : std::span<float>(),
        .old = ahead.history == PixelHistory::moved ? &ahead.old : nullptr,
        .located = ahead.is_located ? std::span(ahead.located).first(populations)
                                    : std::span<const kernels::LocatedDirections>(),
        .memory = state.memory_of(index),
        .neighbors =
            reprojection_ != nullptr ? reprojection_->neighbors(i) : std::span<const CarriedSet>()};
    const PixelDiagnostics did =
        sample_populations(sampler, n, input, index, *scratch_, state, colors);
    if (context_.sampler->chooses_rays()) {
      cast_rays(batch, i, scratch_->rays);
    } else {
      cast_pixel_samples(batch, i, n, colors, state);
    }
    batch.end_ray[i] = batch.rays.size();

    // Keep the books.
    PixelResult& pixel = batch.pixels[i];
    pixel.mask = 1;
    pixel.lns = mean_lns(state, index);
    pixel.source = latest_source(state, index);
    record_sampling(did, n > 0 ? n : static_cast<std::size_t>(context_.job.sampling.num_particles),
                    pixel, frame_sampling_);
    stats_.target_evaluations += static_cast<std::uint64_t>(did.target_evaluations);
  }
}

/// Particles of the pixels whose material has no setting of its own.
std::size_t TileFrameRenderer::num_common_particles(const SampleState& state) const {
  const SamplingSpec& sampling = context_.job.sampling;
  const bool alike = sampling.by_material.empty();
  return static_cast<std::size_t>(alike ? state.num_particles : sampling.num_particles);
}

/// Where the shadow rays of a pixel's sites start.
SiteOrigins TileFrameRenderer::origins(std::size_t index) const {
  const std::span<const SurfaceHit> hits = surfaces_.pixel(index);
  SiteOrigins origins{.num_sites = surfaces_.num_sites};
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) origins.set(s, hits[s].ray_origin);
  }
  return origins;
}

/// Casts the rays of the `n` samples of batch pixel `i`.
void TileFrameRenderer::cast_pixel_samples(Batch& batch, std::size_t i, std::size_t n,
                                           const SampleColors& colors, const SampleState& state) {
  const std::size_t index = batch.first + i;
  const auto num_populations = static_cast<std::size_t>(state.num_populations);
  const auto row = static_cast<std::size_t>(state.num_particles);
  const std::size_t m = n / num_populations;
  const SiteOrigins from = origins(index);
  for (std::size_t k = 0; k < num_populations; ++k) {
    const std::size_t first = index * row + k * m;
    cast_samples({.direction = std::span(state.direction).subspan(first, m),
                  .site = std::span(state.site).subspan(first, m),
                  .weight = std::span(state.weight).subspan(first, m),
                  .r = &colors.r[k * m],
                  .g = &colors.g[k * m],
                  .b = &colors.b[k * m],
                  .unit_contribution = unit_contribution(state, index, k),
                  .picture_scale = picture_scale_[k],
                  .visibility_scale = 1.0f / static_cast<float>(num_populations),
                  .first_sample = static_cast<std::uint32_t>(i * batch.stride + k * m)},
                 from, batch.rays, targets_of(index, state).subspan(k * m, m));
  }
}

/// Casts the rays that the sampler chose for batch pixel `i`.
void TileFrameRenderer::cast_rays(Batch& batch, std::size_t i, const PixelRays& rays) {
  const std::size_t first = i * batch.stride;
  baton::cast_rays(rays, origins(batch.first + i), static_cast<std::uint32_t>(first), batch.rays);
  std::copy_n(rays.bin.from(0), rays.count, &batch.bin[first]);
  batch.pixels[i].radiance = rays.constant.color;
  batch.pixels[i].visibility = rays.constant.visibility;
  batch.difference[i] = rays.difference;
  batch.light_variance[i] = rays.light_variance;
}

/// Pass: visibility of all samples of the batch at once.
void TileFrameRenderer::trace(Batch& batch) {
  const StageTimer timer(stages_.visibility);
  geometry_.accel->occluded(batch.rays.rays);
  stats_.rays_shadow += batch.rays.size();
}

/// Pass: sums the free rays of each pixel, and remembers what they found.
void TileFrameRenderer::shade(Batch& batch, SampleState& state) {
  const StageTimer timer(stages_.shade);
  std::size_t first = 0;
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::size_t end = batch.end_ray[i];
    if (first == end) continue;
    const FreeLight found = sum_free(batch.rays, first, end);
    PixelResult& pixel = batch.pixels[i];
    pixel.radiance += found.color;
    pixel.visibility += found.visibility;
    if (static_cast<std::size_t>(std::popcount(found.is_free)) < end - first) pixel.mask = 0;

    // The even and the odd ray of each pair, and candidates likewise, make two estimates that agree
    // in the mean: the square of half their difference is at least the variance of the whole, as
    // neighbours differ least.
    const float d = batch.difference[i] + found.difference;
    pixel.variance = context_.sampler->chooses_rays() ? d * d : 0.0f;
    remember(batch, i, first, found.is_free, state);
    first = end;
  }
}

/// Tells the second pass, the pixel's memory and its samples what the rays of batch pixel `i`
/// found, from `first` on.
void TileFrameRenderer::remember(const Batch& batch, std::size_t i, std::size_t first,
                                 std::uint64_t is_free, SampleState& state) {
  const std::size_t end = batch.end_ray[i];
  const std::span<MemoryCell> memory = state.memory_of(batch.first + i);
  if (context_.sampler->forgets_blocked()) {
    forget_blocked(batch.rays, first, end, static_cast<std::uint32_t>(i * batch.stride),
                   batch.first + i, state);
  }
  if (!memory.empty()) {
    remember_rays(memory, std::span(batch.bin).subspan(i * batch.stride, end - first), is_free);
    remember_light_variance(memory, batch.light_variance[i]);
  }
  if (!context_.job.visibility.correlated) return;
  for (std::size_t r = first; r < end; ++r) {
    collector_.add_ray(state, batch.first * batch.stride + batch.rays.sample[r],
                       (is_free >> (r - first) & 1) == 0);
  }
}

/// The judge's way: no samples are kept.
void TileFrameRenderer::render_reference(Batch& batch, const FrameLight& light,
                                         SampleState& state) {
  const StageTimer timer(stages_.sample);
  const ReferenceRenderer renderer(*geometry_.accel, context_.scene->materials);
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::size_t index = batch.first + i;
    const std::span<const SurfaceHit> hits = surfaces_.pixel(index);
    const bool seen = surfaces_.sees_surface(index);
    state.source[index] = seen ? PixelSource::fresh : PixelSource::background;
    if (!seen) {
      ++stats_.pixels_background;
      continue;
    }
    const ReferenceEstimate estimate = renderer.render(
        hits, light.now, context_.job.sampling.reference_samples,
        batch.key(context_, surfaces_.rect, index), batch.rays.rays, stats_.rays_shadow);
    state.lns[index] = state.lns_fresh[index] = estimate.lns;
    PixelResult& pixel = batch.pixels[i];
    pixel.radiance = estimate.radiance;
    pixel.lns = estimate.lns;
    pixel.visibility = estimate.visibility;
    pixel.mask = estimate.visibility < 1 ? 0.0f : 1.0f;
    pixel.variance = estimate.mean_variance;
    pixel.source = PixelSource::fresh;
    ++frame_sampling_.pixels_fresh;
    frame_sampling_.count_ess(0);
    stats_.target_evaluations +=
        2 * static_cast<std::uint64_t>(context_.job.sampling.reference_samples);
  }
}

/// Pass: adds what is not sampled and writes the film.
void TileFrameRenderer::finish(Batch& batch, const FrameLight& light, FilmWriter& film) {
  const StageTimer timer(stages_.shade);
  const bool show_environment = context_.job.output.background == Background::environment;
  std::array<Rgb, kBatchPixels> background{};
  if (show_environment) {
    const auto num_sites = static_cast<std::size_t>(surfaces_.num_sites);
    add_environment_behind(
        std::span(surfaces_.hits).subspan(batch.first * num_sites, batch.count * num_sites),
        std::span(surfaces_.rays).subspan(batch.first * num_sites, batch.count * num_sites),
        surfaces_.num_sites, view_of(light.now), background);
  }
  for (std::size_t i = 0; i < batch.count; ++i) {
    PixelResult& pixel = batch.pixels[i];
    record_geometry(surfaces_.pixel(batch.first + i), pixel);
    pixel.radiance += background[i];
    if (show_environment) pixel.alpha = 1;
    film.write(batch.first + i, pixel);
  }
}

}  // namespace baton
