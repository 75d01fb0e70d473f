#include "worker/pass/first_pass_collector.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/state/sample_planes.h"
#include "worker/method/weighted/populations.h"

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
  first_.assign(state.num_pixels(), 0);
}

void FirstPassCollector::add_rays(const SampleState& state, std::size_t pixel,
                                  const FoundRays& found) {
  first_[pixel] = static_cast<std::uint32_t>(samples_.slot.size());
  const std::size_t first = pixel * static_cast<std::size_t>(state.num_particles);
  for (std::size_t i = 0; i < found.sample.size(); ++i)
    add_ray(state, first + found.sample[i], !found.free(i));
}

/// Rays must come by particle, ascending. particle: pixel * N + j.
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
  if (!(image_scale(job_, population) > 0)) return;
  ++samples_.count[pixel];
  samples_.slot.push_back(static_cast<std::uint8_t>(slot));
  const ConstSamplePlanes planes(state);
  samples_.site.push_back(planes.site[particle]);
  samples_.direction.push_back(planes.direction[particle]);
  samples_.energy.push_back(unit_contribution(state, pixel, static_cast<std::size_t>(population)) *
                            planes.weight[particle]);
}

template <class T>
void FirstPassCollector::put_in_order(std::vector<T>& column) const {
  std::vector<T> ordered;
  ordered.reserve(column.size());
  for (std::size_t pixel = 0; pixel < first_.size(); ++pixel)
    std::copy_n(column.begin() + first_[pixel], samples_.count[pixel], std::back_inserter(ordered));
  column = std::move(ordered);
}

FirstPassSamples FirstPassCollector::finish(const SampleState& state, Step step) {
  samples_.step = step;
  for (std::size_t pixel = 0; pixel < state.num_pixels(); ++pixel) {
    if (state.latest_source(pixel) != PixelSource::background)
      samples_.flags[pixel] |= FirstPassSamples::kSurface;
  }
  const SecondPassForm form = job_.visibility.form;
  if (form == SecondPassForm::published || form == SecondPassForm::published_kept)
    std::ranges::copy(ConstSamplePlanes(state).lns, std::back_inserter(samples_.lns));
  put_in_order(samples_.slot);
  put_in_order(samples_.site);
  put_in_order(samples_.direction);
  put_in_order(samples_.energy);
  samples_.keep_possible(job_.visibility.dilate);
  return std::exchange(samples_, {});
}

}  // namespace baton
