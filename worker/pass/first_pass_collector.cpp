#include "worker/pass/first_pass_collector.h"

#include <utility>

#include "worker/method/populations.h"
#include "worker/method/weighted_method.h"

namespace baton {

void FirstPassCollector::begin(const SampleState& state) {
  samples_ = {};
  samples_.picture = state.picture;
  samples_.tile = state.tile;
  samples_.rect = state.rect;
  samples_.num_slots = state.num_particles;
  samples_.num_populations = state.num_populations;
  samples_.flags.assign(state.num_pixels(), 0);
  samples_.count.assign(state.num_pixels(), 0);
}

void FirstPassCollector::add_ray(const SampleState& state, std::size_t particle, bool occluded) {
  const auto n = static_cast<std::size_t>(state.num_particles);
  const std::size_t pixel = particle / n;
  const std::size_t slot = particle % n;
  const auto population =
      static_cast<std::int32_t>(slot * static_cast<std::size_t>(state.num_populations) / n);
  if (occluded) {
    samples_.flags[pixel] |= FirstPassSamples::kFailed[population];
    return;
  }
  if (!(picture_scale(job_, population) > 0)) return;
  ++samples_.count[pixel];
  samples_.slot.push_back(static_cast<std::uint8_t>(slot));
  samples_.site.push_back(state.site[particle]);
  samples_.direction.push_back(state.direction[particle]);
  samples_.energy.push_back(unit_contribution(state, pixel, static_cast<std::size_t>(population)) *
                            state.weight[particle]);
}

FirstPassSamples FirstPassCollector::finish(const SampleState& state, Step step) {
  samples_.step = step;
  for (std::size_t pixel = 0; pixel < state.num_pixels(); ++pixel) {
    if (latest_source(state, pixel) != PixelSource::background)
      samples_.flags[pixel] |= FirstPassSamples::kSurface;
  }
  const SecondPassForm form = job_.visibility.form;
  if (form == SecondPassForm::published || form == SecondPassForm::published_kept)
    samples_.lns = state.lns;
  samples_.keep_possible(job_.visibility.dilate);
  return std::exchange(samples_, {});
}

}  // namespace baton
