#include "worker/method/weighted/weighted_sampler.h"

#include <utility>

#include "common/base/poison.h"
#include "common/job/job_facts.h"
#include "worker/method/weighted/populations.h"

namespace baton {
namespace {

class FreshWeightedSampler final : public WeightedSampler {
 public:
  explicit FreshWeightedSampler(const JobSpec& job)
      : WeightedSampler(job), sampler_(make_fresh_sampler(population_spec(job))) {}

 private:
  PixelDiagnostics draw(const PixelInput& input, const SetPlace& /*at*/,
                        const PixelSamples& samples) override {
    return sampler_->sample(input, samples);
  }
  std::unique_ptr<FreshSampler> sampler_;
};

void add(const MoveCounts& from, MoveCounts& to) {
  to.proposed += from.proposed;
  to.accepted += from.accepted;
}

}  // namespace

PixelMethod make_fresh_method(const JobSpec& job) {
  return {.format = &sample_format(),
          .start = [job] { return std::make_unique<FreshWeightedSampler>(job); }};
}

WeightedSampler::WeightedSampler(const JobSpec& job)
    : num_particles_(static_cast<std::size_t>(job.sampling.num_particles)) {
  for (std::int32_t k = 0; k < num_populations(job); ++k)
    image_scale_.push_back(image_scale(job, k));
}

void WeightedSampler::begin_round(const SampleState& state, bool goes_on) {
  // The targets of the round before are there if it was rendered here.
  const std::size_t num_samples =
      state.num_pixels() * static_cast<std::size_t>(state.num_particles);
  knows_targets_ = goes_on && targets_.size() == num_samples;
  targets_.resize(num_samples);
}

PixelDiagnostics WeightedSampler::sample(const PixelInput& input, const PixelState& pixel,
                                         RayWriter& rays) {
  SampleState& state = pixel.tile;
  const SamplePlanes planes(state);
  const std::size_t populations = image_scale_.size();
  const std::size_t n = num_particles_ / populations;
  // A material may have fewer samples than the state has room for.
  const std::size_t stride = static_cast<std::size_t>(state.num_particles) / populations;
  poison(colors_);
  PixelDiagnostics sum{.num_samples = static_cast<std::int32_t>(n * populations)};
  PixelInput population_input = input;
  for (std::size_t k = 0; k < populations; ++k) {
    population_input.key.job_seed = stream_seed(input.key.job_seed, static_cast<std::uint32_t>(k));
    const std::size_t row = pixel.index * populations + k, first = row * stride;
    const PixelSamples samples{planes.direction.subspan(first, n),
                               planes.site.subspan(first, n),
                               planes.weight.subspan(first, n),
                               std::span(colors_.r).subspan(k * n, n),
                               std::span(colors_.g).subspan(k * n, n),
                               std::span(colors_.b).subspan(k * n, n),
                               planes.lns[row],
                               planes.lns_fresh[row],
                               state.source[row]};
    const std::span<float> target = std::span(targets_).subspan(first, n);
    const PixelDiagnostics did = draw(
        population_input, {pixel, k, knows_targets_ ? target : std::span<const float>()}, samples);
    rays.add({.direction = samples.direction,
              .site = samples.site,
              .weight = samples.weight,
              .r = samples.r.data(),
              .g = samples.g.data(),
              .b = samples.b.data(),
              .unit_contribution = unit_contribution(state, pixel.index, k),
              .image_scale = image_scale_[k],
              .visibility_scale = 1.0f / static_cast<float>(populations),
              .first_sample = static_cast<std::uint32_t>(k * n)},
             target);
    sum.ess += did.ess;
    sum.target_evaluations += did.target_evaluations;
    add(did.local, sum.local);
    add(did.independent, sum.independent);
    sum.refreshed_by_ratio = sum.refreshed_by_ratio || did.refreshed_by_ratio;
    sum.resampled = sum.resampled || did.resampled;
  }
  sum.lns = mean_lns(state, pixel.index);
  return sum;
}

}  // namespace baton
