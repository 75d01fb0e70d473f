#include "worker/pass/traced_exchange.h"

#include <algorithm>

#include "worker/integrator/kernels.h"
#include "worker/pass/cpu_clock.h"

namespace baton {

TracedExchange::TracedExchange(const Accel& accel, const EnvironmentView& environment,
                               const SampleRegion& samples, const MaskedSurfaces& surfaces,
                               const PixelRect& exchange_rect, std::int32_t num_sites)
    : accel_(accel),
      environment_(environment),
      samples_(samples),
      surfaces_(surfaces),
      rect_(exchange_rect),
      num_sites_(num_sites) {}

float TracedExchange::lns(const SampleRegion::Place& place) const {
  if (place.tile->lns.empty()) return 0;
  const auto k = static_cast<std::size_t>(place.tile->num_populations);
  return place.tile
      ->lns[place.pixel * k + static_cast<std::size_t>(std::max(fold_.giver_population, 0))];
}

float TracedExchange::lns(std::uint32_t receiver) const {
  const auto width = static_cast<std::uint32_t>(rect_.width());
  return lns(samples_.find(rect_.x0 + static_cast<std::int32_t>(receiver % width),
                           rect_.y0 + static_cast<std::int32_t>(receiver / width)));
}

void TracedExchange::append_samples(std::int32_t x, std::int32_t y,
                                    std::vector<GiverSample>& batch) {
  if (batch.empty()) light_.clear();
  const SampleRegion::Place place = samples_.find(x, y).of_population(fold_.giver_population);
  if (place.count == 0) return;
  const FirstPassSamples& from = *place.tile;

  // See what its own surfaces make of the light along its samples.
  const std::size_t first = light_.size();
  light_.resize(first + place.count);
  kernels::look_up_lights(environment_, std::span(from.direction).subspan(place.first, place.count),
                          std::span(light_).subspan(first));
  const std::int32_t first_surface = surfaces_.find(PixelMask::index(rect_, x, y)) * num_sites_;
  pairs_.resize(std::max(pairs_.size(), place.count));
  for (std::size_t i = 0; i < place.count; ++i) {
    pairs_[i] = {first_surface + from.site[place.first + i], static_cast<std::int32_t>(first + i)};
  }
  own_.resize(place.count + kernels::kPadding);
  kernels::reflect_lights(surfaces_.table(), light_, std::span(pairs_).first(place.count), own_);

  // Offer what reflects.
  const float pixel_lns = lns(place);
  std::size_t end = first;
  for (std::size_t i = 0; i < place.count; ++i) {
    if (!(own_[i].target > kSmallestTarget)) continue;
    batch.push_back({.slot = from.slot[place.first + i],
                     .energy = from.energy[place.first + i] * fold_.energy_scale,
                     .lns = pixel_lns,
                     .reflected = own_[i]});
    light_[end++] = light_[first + i];
  }
  light_.resize(end);
}

void TracedExchange::receive(std::span<const Offer> offers, std::span<Reflected> receptions) {
  // Evaluate the products.
  pairs_.resize(std::max(pairs_.size(), offers.size()));
  const std::int32_t num_sites = num_sites_;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    pairs_[i] = {
        surfaces_.find(offers[i].receiver) * num_sites + static_cast<std::int32_t>(offers[i].site),
        static_cast<std::int32_t>(offers[i].sample)};
  }
  kernels::reflect_lights(surfaces_.table(), light_, std::span(pairs_).first(offers.size()),
                          receptions);

  // Trace rays where there is a product.
  rays_.clear();
  rays_.reserve(offers.size() + 1);
  offer_of_ray_.resize(std::max(offer_of_ray_.size(), offers.size() + 1));
  for (std::size_t i = 0; i < offers.size(); ++i) {
    offer_of_ray_[rays_.size()] = static_cast<std::uint32_t>(i);
    rays_.push_if(receptions[i].target > 0,
                  surfaces_.table().ray_origin(static_cast<std::size_t>(pairs_[i].surface)),
                  light_[offers[i].sample].direction);
  }
  {
    const StageTimer timer(seconds_rays_);
    accel_.occluded(rays_);
  }
  rays_traced_ += rays_.size();

  // Of the blocked ones nothing is seen; what is free writes into the padding instead: a guess of
  // the processor would fail too often.
  for (std::size_t r = 0; r < rays_.size(); ++r)
    receptions[rays_.t_far[r] < 0 ? offer_of_ray_[r] : offers.size()] = {};
}

}  // namespace baton
