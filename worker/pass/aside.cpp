#include "worker/pass/aside.h"

namespace baton {

Rgb AsideSampler::sample(const PixelMethod& method, const PixelInput& input, const Aside& aside,
                         const PixelState& pixel) {
  const SampleState& tile = pixel.tile;
  if (state_.format == tile.format && state_.num_particles == tile.num_particles) {
    state_.forget_pixel(0);
    state_.forget_block(0);
  } else {
    state_.resize(*tile.format, {0, 0, 1, 1}, tile.num_particles, tile.num_populations);
  }
  if (!aside.starts_afresh) {
    state_.copy_pixels(tile, pixel.index, 0, 1);
    state_.copy_block(tile, PixelBlocks(tile.rect).of(pixel.index), 0);
  }
  std::unique_ptr<TileSampler>& sampler = samplers_[&method];
  if (sampler == nullptr) sampler = method.start();
  sampler->begin_round(state_, false);
  rays_.clear();
  RayWriter writer(aside.origins, rays_);
  sampler->sample({.sites = aside.sites,
                   .light = aside.light,
                   .presampled = aside.presampled,
                   .key = aside.key,
                   .rounds_before = input.rounds_before,
                   .start = {.has_history = input.start.has_history && !aside.starts_afresh},
                   .hits = aside.hits,
                   .geometry = input.geometry},
                  {state_, 0, pixel.sees_catcher}, writer);
  input.geometry->accel->occluded(rays_.rays);
  return writer.known.color + sum_free(rays_, 0, rays_.size()).color;
}

}  // namespace baton
