#include "worker/exchange/extra_samples.h"

#include "common/base/poison.h"
#include "worker/exchange/energy_exchange.h"
#include "worker/method/populations.h"
#include "worker/pass/cpu_clock.h"
#include "worker/pass/primary.h"
#include "worker/sampling/folds.h"

namespace baton {

ExtraSampler::ExtraSampler(const SecondPassWork& work)
    : work_(work),
      now_(view_of(work.light.now)),
      before_(view_of(work.light.before)),
      sampler_(make_pixel_sampler(population_spec(work.context.job))),
      scratch_(std::make_unique<SamplerScratch>()) {
  drawn_.resize({0, 0, 1, 1}, population_spec(work.context.job).num_particles);
}

Rgb ExtraSampler::radiance(std::int32_t x, std::int32_t y, std::size_t fold) {
  const std::int32_t position = work_.surfaces.find(work_.masks.any.index(x, y));
  poison(sites_);
  CatcherAlbedo none;  // there are no catchers beside a second pass
  gather_sites(work_.geometry, work_.surfaces.hits(position), {}, sites_, none);
  const Rgb first = first_pass(work_.samples.find(x, y), fold);
  if (!work_.masks.of_fold[fold].at(x, y)) return first;
  draw(x, y, fold, work_.surfaces.hits(position));
  const auto& folds = folds_of(work_.context.job.visibility.mask);
  const float share =
      folds[fold].energy_scale / static_cast<float>(num_populations(work_.context.job));
  return (first + trace() * share) /
         static_cast<float>(1 + work_.context.job.visibility.partitions);
}

/// What the fold's own free samples say.
Rgb ExtraSampler::first_pass(const SampleRegion::Place& pixel, std::size_t fold) {
  const Fold& use = folds_of(work_.context.job.visibility.mask)[fold];
  const SampleRegion::Place place = pixel.of_population(use.giver_population);
  const FirstPassSamples& from = *place.tile;
  kernels::ShadedSamples shaded;
  poison(shaded);
  kernels::shade_samples(sites_, now_, std::span(from.direction).subspan(place.first, place.count),
                         std::span(from.site).subspan(place.first, place.count), shaded);
  Rgb sum;
  for (std::size_t i = 0; i < place.count; ++i) {
    sum += Rgb{shaded.r[i], shaded.g[i], shaded.b[i]} *
           (from.energy[place.first + i] * use.energy_scale);
  }
  return sum;
}

/// Draws all extra sets of one pixel and fold into `rays_`.
void ExtraSampler::draw(std::int32_t x, std::int32_t y, std::size_t fold,
                        std::span<const SurfaceHit> hits) {
  rays_.clear();
  SiteOrigins origins;
  origins.num_sites = work_.context.job.image.sites;
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) origins.set(s, hits[s].ray_origin);
  }
  const auto count = static_cast<std::uint32_t>(work_.context.job.visibility.partitions);
  SampleColors colors;
  std::array<float, limits::kMaxParticles> targets{};
  for (std::uint32_t c = 0; c < count; ++c) {
    // Streams 0 and 1 are the first pass's populations.
    const std::uint32_t stream = 2 + static_cast<std::uint32_t>(fold) * count + c;
    const JobSpec& job = work_.context.job;
    const RngKey key =
        pixel_key(stream_seed(job.seed, stream), work_.frame.number.value(), job.image.width, x, y);
    poison(*scratch_);
    sample_populations(*sampler_, static_cast<std::size_t>(drawn_.num_particles),
                       {sites_, work_.light, work_.light.presampled->of(x, y), now_, before_, key,
                        work_.frame.step.value(), false},
                       0, *scratch_, drawn_, colors);
    cast_samples({.direction = drawn_.direction,
                  .site = drawn_.site,
                  .weight = drawn_.weight,
                  .r = colors.r.data(),
                  .g = colors.g.data(),
                  .b = colors.b.data(),
                  .unit_contribution = unit_contribution(drawn_, 0, 0),
                  .picture_scale = 1,
                  .visibility_scale = 1,
                  .first_sample = 0},
                 origins, rays_, std::span(targets).first(drawn_.weight.size()));
  }
}

/// Sum of the extra sets.
Rgb ExtraSampler::trace() {
  {
    const StageTimer timer(seconds_rays_);
    work_.geometry.accel->occluded(rays_.rays);
  }
  rays_traced_ += rays_.size();
  Rgb sum;
  for (std::size_t r = 0; r < rays_.size(); ++r) {
    if (!(rays_.rays.t_far[r] < 0)) sum += Rgb{rays_.r[r], rays_.g[r], rays_.b[r]};
  }
  return sum;
}

}  // namespace baton
