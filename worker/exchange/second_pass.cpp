#include "worker/exchange/second_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "common/base/cpu_clock.h"
#include "common/job/aov.h"
#include "worker/exchange/extra_samples.h"
#include "worker/exchange/traced_exchange.h"
#include "worker/sampling/folds.h"

namespace baton {
namespace {

Status check_inputs(const RenderContext& context, Step step, std::int32_t tile,
                    const FilmTile& film, std::span<const FirstPassPtr> near) {
  const std::vector<std::int32_t> tiles =
      context.grid.tiles_near(tile, exchange_reach_px(context.job.visibility));
  if (near.size() != tiles.size()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("tile {} frame index {}: samples of {} tiles, expected {}", tile, step,
                             near.size(), tiles.size())};
  }
  for (std::size_t i = 0; i < near.size(); ++i) {
    const FirstPassSamples& s = *near[i];
    if (s.picture == context.picture && s.step == step && s.tile == tiles[i] &&
        s.rect == context.grid.rect(tiles[i]) &&
        s.num_slots == context.job.sampling.num_particles &&
        s.num_populations == num_populations(context.job)) {
      continue;
    }
    return Error{
        ErrorKind::bad_input,
        fmt::format("first-pass samples: of picture {} tile {} frame index {}, expected {}, {}, {}",
                    s.picture.hex(), s.tile, s.step, context.picture.hex(), tiles[i], step)};
  }
  if (film.rect == context.grid.rect(tile)) return {};
  return Error{ErrorKind::bad_input, fmt::format("film: of another tile than {}", tile)};
}

ExchangeMasks make_masks(const VisibilitySpec& visibility, const SampleRegion& samples,
                         const PixelRect& rect, const PixelRect& rect_before_dilation) {
  ExchangeMasks masks{{}, PixelMask(rect)};
  const PixelMask surfaces = samples.surfaces(rect);
  for (const Fold& fold : folds_of(visibility.mask)) {
    masks.of_fold.push_back(dilate(samples.failed(rect_before_dilation, fold.mask_population),
                                   visibility.dilate, surfaces, rect));
    masks.any.add(masks.of_fold.back());
  }
  return masks;
}

/// The exchange, fold by fold.
void exchange(const SecondPassWork& work, std::span<Rgb> radiance, RenderStats& stats) {
  const JobSpec& job = work.context.job;
  const SquarePartitions partitions(
      job.image.extent(), job.visibility.tile_size, job.visibility.partitions,
      Rng({.job_seed = job.seed,
           .frame = static_cast<std::uint32_t>(work.frame.number.value()),
           .pixel = 0},
          PassId::partition));
  TracedExchange scene(work);
  ExchangeSettings settings{.form = job.visibility.form,
                            .num_slots = static_cast<std::uint32_t>(job.sampling.num_particles),
                            .num_sites = static_cast<std::uint32_t>(job.image.sites),
                            .fold = 0,
                            .job_seed = job.seed,
                            .frame = work.frame.number.value(),
                            .image_width = job.image.width};
  for (const Fold& fold : folds_of(job.visibility.mask)) {
    scene.use(fold);
    exchange_energy(settings, partitions, work.masks.of_fold[settings.fold], work.masks.any,
                    work.rect, scene, radiance);
    ++settings.fold;
  }
  stats.rays_second_pass += scene.rays_traced();
  stats.seconds_second_rays += scene.seconds_rays();
}

/// The baseline: more samples of the pixels themselves.
void sample_more(const SecondPassWork& work, std::span<Rgb> radiance, RenderStats& stats) {
  ExtraSampler sampler(work);
  const PixelRect& rect = work.rect;
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    work.masks.any.visit_row(rect.x0, rect.x1, y, [&](std::int32_t x) {
      Rgb& pixel = radiance[PixelMask::index(rect, x, y)];
      for (std::size_t fold = 0; fold < work.masks.of_fold.size(); ++fold)
        pixel += sampler.radiance(x, y, fold);
    });
  }
  stats.rays_second_pass += sampler.rays_traced();
  stats.seconds_second_rays += sampler.seconds_rays();
}

/// The planes of three channels; nullopt where the film has none.
std::optional<std::array<float*, 3>> planes_of(Aov aov, FilmTile& film) {
  std::array<float*, 3> planes{};
  for (std::size_t c = 0; c < planes.size(); ++c) planes[c] = film.find(traits(aov).channels[c]);
  return planes[0] != nullptr ? std::optional(planes) : std::nullopt;
}

/// Puts the pixels of the mask into the film. Light between surfaces stays as it is.
void write_pixels(const SecondPassWork& work, std::span<const Rgb> radiance, FilmTile& film,
                  RenderStats& stats) {
  const bool show_environment = work.context.job.output.background == Background::environment;
  float* const mask = film.find("mask");
  const auto indirect = planes_of(Aov::indirect, film), direct = planes_of(Aov::direct, film);
  for (std::int32_t y = work.rect.y0; y < work.rect.y1; ++y) {
    for (std::int32_t x = work.rect.x0; x < work.rect.x1; ++x) {
      if (!work.masks.any.at(x, y)) continue;
      const std::size_t pixel = PixelMask::index(work.rect, x, y);
      const std::int32_t position = work.surfaces.find(work.masks.any.index(x, y));
      Rgb value = radiance[pixel] + work.surfaces.emission(position);
      if (show_environment) value += work.surfaces.background(position, work.light.seen);
      const std::array<float, 3> colors{value.x, value.y, value.z};
      for (std::size_t c = 0; c < colors.size(); ++c) {
        if (direct) (*direct)[c][pixel] = colors[c];
        film.plane(c)[pixel] = colors[c] + (indirect ? (*indirect)[c][pixel] : 0);
      }
      if (mask != nullptr) mask[pixel] = 0;
      ++stats.pixels_masked;
    }
  }
}

/// The light of the frame; preparing it, where the first pass left none, counts as in that pass.
Result<std::shared_ptr<const FrameLight>> light_of(const RenderContext& context, Step step,
                                                   RenderStats& stats) {
  const CpuTimer timer(stats.seconds_light);
  return context.lights->at(step);
}

}  // namespace

Result<SecondPassOutput> run_second_pass(const RenderContext& context, Step step, std::int32_t tile,
                                         const FilmTile& first_film,
                                         std::span<const FirstPassPtr> near) {
  const WorkClock clock;
  BATON_TRY(check_inputs(context, step, tile, first_film, near));
  SecondPassOutput output{.film = first_film};

  // Find who takes part.
  const VisibilitySpec& visibility = context.job.visibility;
  const SampleRegion samples(near);
  const PixelRect rect = context.grid.rect(tile);
  const PixelRect image = context.job.image.rendered();
  const PixelRect reach = grown(rect, visibility.tile_size - 1, image);
  const ExchangeMasks masks =
      make_masks(visibility, samples, reach, grown(reach, visibility.dilate, image));

  // Do their pixels again.
  BATON_ASSIGN(const auto geometry, context.geometry->at(step));
  const MaskedSurfaces surfaces(context, *geometry, masks.any);
  output.stats.rays_primary = surfaces.num_rays();
  output.seconds_primary_rays = surfaces.seconds_rays();
  BATON_ASSIGN(const auto light, light_of(context, step, output.stats));
  const SecondPassWork work{
      context, *geometry, context.frames[step.index()], *light, samples, masks, surfaces, rect};
  std::vector<Rgb> radiance(static_cast<std::size_t>(rect.area()));
  if (visibility.form == SecondPassForm::extra_samples) {
    sample_more(work, radiance, output.stats);
  } else {
    exchange(work, radiance, output.stats);
  }
  write_pixels(work, radiance, output.film, output.stats);
  const double share = clock.running_share();
  output.stats.seconds_second_rays *= share;
  output.seconds_primary_rays *= share;
  output.stats.cpu_seconds = clock.cpu_seconds();
  output.stats.seconds_second_pass = output.stats.cpu_seconds - output.stats.seconds_light;
  return output;
}

}  // namespace baton
