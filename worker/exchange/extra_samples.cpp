#include "worker/exchange/extra_samples.h"

#include "common/base/cpu_clock.h"
#include "common/base/poison.h"
#include "worker/exchange/energy_exchange.h"
#include "worker/method/weighted/populations.h"
#include "worker/pass/primary.h"
#include "worker/sampling/folds.h"

namespace baton {
namespace {

/// One population of one pixel.
struct DrawnSet {
  template <class T>
  using Column = std::array<T, limits::kMaxParticles>;
  Column<OctDirection> direction;
  Column<std::uint8_t> site;
  Column<float> weight, r, g, b, target;
  float lns, lns_fresh;
  PixelSource source;

  PixelSamples samples(std::size_t n) {
    return {std::span(direction).first(n),
            std::span(site).first(n),
            std::span(weight).first(n),
            std::span(r).first(n),
            std::span(g).first(n),
            std::span(b).first(n),
            lns,
            lns_fresh,
            source};
  }
};

}  // namespace

ExtraSampler::ExtraSampler(const SecondPassWork& work)
    : work_(work),
      light_{work.light},
      num_samples_(static_cast<std::size_t>(population_spec(work.context.job).num_particles)),
      sampler_(make_fresh_sampler(population_spec(work.context.job))) {}

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
  kernels::shade_samples(sites_, light_.now,
                         std::span(from.direction).subspan(place.first, place.count),
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
  for (std::uint32_t c = 0; c < count; ++c) {
    // Streams 0 and 1 are the first pass's populations.
    const std::uint32_t stream = 2 + static_cast<std::uint32_t>(fold) * count + c;
    const JobSpec& job = work_.context.job;
    const RngKey key =
        pixel_key(stream_seed(job.seed, stream), work_.frame.number.value(), job.image.width, x, y);
    DrawnSet drawn;
    poison(drawn);
    const PixelSamples samples = drawn.samples(num_samples_);
    sampler_->sample({.sites = sites_,
                      .light = light_,
                      .presampled = work_.light.presampled->of(x, y),
                      .key = key,
                      .rounds_before = work_.frame.step.value()},
                     samples);
    cast_samples({.direction = samples.direction,
                  .site = samples.site,
                  .weight = samples.weight,
                  .r = samples.r.data(),
                  .g = samples.g.data(),
                  .b = samples.b.data(),
                  .unit_contribution = samples.lns,
                  .image_scale = 1,
                  .visibility_scale = 1,
                  .first_sample = 0},
                 origins, rays_, std::span(drawn.target).first(num_samples_));
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
