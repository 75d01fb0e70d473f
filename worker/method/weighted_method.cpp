#include "worker/method/weighted_method.h"

#include <utility>

#include "common/base/poison.h"
#include "common/job/plan/sequence.h"
#include "worker/light/carried_light.h"
#include "worker/method/blocked_samples.h"
#include "worker/method/populations.h"
#include "worker/sampling/folds.h"

namespace baton {

float picture_scale(const JobSpec& job, std::int32_t population) {
  if (num_populations(job) == 1) return 1;
  float scale = 0;
  for (const Fold& fold : folds_of(job.visibility.mask)) {
    if (fold.giver_population == population) scale += fold.energy_scale;
  }
  return scale;
}

WeightedMethod::WeightedMethod(const JobSpec& job)
    : WeightedMethod(job, make_pixel_sampler(population_spec(job))) {}

WeightedMethod::WeightedMethod(const JobSpec& job, std::unique_ptr<const PixelSampler> sampler)
    : sampler_(std::move(sampler)),
      num_particles_(static_cast<std::size_t>(job.sampling.num_particles)) {
  for (std::int32_t k = 0; k < num_populations(job); ++k)
    picture_scale_.push_back(picture_scale(job, k));
}

PixelDiagnostics WeightedMethod::sample(const PixelInput& input, const PixelState& pixel,
                                        SamplerScratch& scratch, RayWriter& rays) const {
  const SampleState& state = pixel.tile;
  SampleColors colors;
  const PixelDiagnostics did = sample_populations(*sampler_, num_particles_, input, pixel.index,
                                                  scratch, pixel.tile, colors);
  const std::size_t num_populations = picture_scale_.size();
  const std::size_t m = num_particles_ / num_populations;
  for (std::size_t k = 0; k < num_populations; ++k) {
    const std::size_t first = pixel.index * static_cast<std::size_t>(state.num_particles) + k * m;
    rays.add({.direction = std::span(state.direction).subspan(first, m),
              .site = std::span(state.site).subspan(first, m),
              .weight = std::span(state.weight).subspan(first, m),
              .r = &colors.r[k * m],
              .g = &colors.g[k * m],
              .b = &colors.b[k * m],
              .unit_contribution = unit_contribution(state, pixel.index, k),
              .picture_scale = picture_scale_[k],
              .visibility_scale = 1.0f / static_cast<float>(num_populations),
              .first_sample = static_cast<std::uint32_t>(k * m)},
             input.target.subspan(k * m, m));
  }
  return did;
}

bool SequentialMethod::look_ahead(const kernels::CarriedLight& light, bool knows_targets,
                                  const PixelState& pixel, LocatedPopulations& located) const {
  const SampleState& state = pixel.tile;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::size_t n = static_cast<std::size_t>(state.num_particles) / populations;
  for (std::size_t k = 0; k < populations; ++k) {
    kernels::locate_directions(
        light.now, knows_targets || light.still ? nullptr : &light.before,
        std::span(state.direction).subspan((pixel.index * populations + k) * n, n), located[k]);
  }
  return true;
}

void RestirMethod::learn(const FoundRays& found, const PixelState& pixel) const {
  if (reuse_visibility_) forget_blocked(found, pixel.index, pixel.tile);
}

}  // namespace baton
