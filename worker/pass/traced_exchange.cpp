#include "worker/pass/traced_exchange.h"

#include <algorithm>
#include <numeric>

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

float TracedExchange::lns(std::int32_t x, std::int32_t y) const {
  const SampleRegion::Place place = samples_.find(x, y);
  if (place.tile->lns.empty()) return 0;
  const auto k = static_cast<std::size_t>(place.tile->num_populations);
  return place.tile
      ->lns[place.pixel * k + static_cast<std::size_t>(std::max(fold_.giver_population, 0))];
}

void TracedExchange::append_samples(std::int32_t x, std::int32_t y,
                                    std::vector<GiverSample>& batch) {
  if (batch.empty()) light_.resize(0);
  const SampleRegion::Place place = samples_.find(x, y).of_population(fold_.giver_population);
  if (place.count == 0) return;
  const FirstPassSamples& from = *place.tile;

  // Look up the light along all its samples, then what its own surfaces make of it.
  std::array<float, limits::kMaxParticles> density;
  pixel_light_.resize(place.count);
  reflected_.resize(place.count);
  kernels::decode_directions(std::span(from.direction).subspan(place.first, place.count),
                             pixel_light_.x, pixel_light_.y, pixel_light_.z);
  kernels::evaluate_environment(environment_, pixel_light_.x, pixel_light_.y, pixel_light_.z,
                                pixel_light_.r, pixel_light_.g, pixel_light_.b,
                                std::span(density).first(place.count));
  const std::int32_t first_surface = surfaces_.find(PixelMask::index(rect_, x, y)) * num_sites_;
  surface_.clear();
  for (std::size_t i = 0; i < place.count; ++i)
    surface_.push_back(first_surface + from.site[place.first + i]);
  light_index_.resize(place.count);
  std::iota(light_index_.begin(), light_index_.end(), 0);
  kernels::reflect_samples(surfaces_.table(), pixel_light_, surface_, light_index_, reflected_);

  // Offer what reflects.
  const float pixel_lns = lns(x, y);
  for (std::size_t i = 0; i < place.count; ++i) {
    const Rgb reflected{reflected_.r[i], reflected_.g[i], reflected_.b[i]};
    if (!(mean(reflected) > 0)) continue;
    batch.push_back({.slot = from.slot[place.first + i],
                     .energy = from.energy[place.first + i] * fold_.energy_scale,
                     .target = mean(reflected),
                     .lns = pixel_lns,
                     .reflected = reflected});
    light_.push_back(pixel_light_, i);
  }
}

void TracedExchange::receive(std::span<const GiverSample>, std::span<const Offer> offers,
                             std::span<Reception> receptions) {
  // Evaluate the products.
  surface_.clear();
  light_index_.clear();
  for (const Offer& offer : offers) {
    surface_.push_back(surfaces_.find(offer.receiver) * num_sites_ +
                       static_cast<std::int32_t>(offer.site));
    light_index_.push_back(static_cast<std::int32_t>(offer.sample));
  }
  reflected_.resize(offers.size());
  kernels::reflect_samples(surfaces_.table(), light_, surface_, light_index_, reflected_);

  // Ask for rays where there is a product.
  rays_.clear();
  offer_of_ray_.clear();
  const bool needs_lns = !offers.empty() && !samples_.find(rect_.x0, rect_.y0).tile->lns.empty();
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const Rgb reflected{reflected_.r[i], reflected_.g[i], reflected_.b[i]};
    receptions[i] = {.target = mean(reflected), .lns = 0, .reflected = reflected, .visible = false};
    if (!(receptions[i].target > 0)) continue;
    if (needs_lns) {
      const auto width = static_cast<std::uint32_t>(rect_.width());
      receptions[i].lns = lns(rect_.x0 + static_cast<std::int32_t>(offers[i].receiver % width),
                              rect_.y0 + static_cast<std::int32_t>(offers[i].receiver / width));
    }
    const std::size_t j = offers[i].sample;
    rays_.push(surfaces_.table().ray_origin(static_cast<std::size_t>(surface_[i])),
               {light_.x[j], light_.y[j], light_.z[j]});
    offer_of_ray_.push_back(static_cast<std::uint32_t>(i));
  }

  // Trace.
  {
    const StageTimer timer(seconds_rays_);
    accel_.occluded(rays_);
  }
  rays_traced_ += rays_.size();
  for (std::size_t r = 0; r < rays_.size(); ++r)
    receptions[offer_of_ray_[r]].visible = !(rays_.t_far[r] < 0);
}

}  // namespace baton
