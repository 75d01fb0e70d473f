#include "worker/pass/aside.h"

#include "common/base/poison.h"

namespace baton {

Rgb AsideSampler::sample(const PixelMethod& method, const PixelInput& pixel, const Aside& aside,
                         const SampleState& like, SamplerScratch& scratch) {
  state_.resize({0, 0, 1, 1}, like.num_particles, like.num_populations);
  if (!like.memory.empty()) state_.add_memory();
  if (aside.memory != nullptr) state_.memory[0] = *aside.memory;
  target_.resize(static_cast<std::size_t>(like.num_particles));
  const PixelInput input{.sites = aside.sites,
                         .light = aside.light,
                         .presampled = aside.presampled,
                         .now = pixel.now,
                         .before = pixel.before,
                         .key = aside.key,
                         .rounds_before = pixel.rounds_before,
                         .has_history = pixel.has_history && aside.memory != nullptr,
                         .target = target_,
                         .hits = aside.hits,
                         .geometry = pixel.geometry};
  rays_.clear();
  RayWriter writer(aside.origins, rays_);
  poison(scratch);
  method.sample(input, {state_, 0}, scratch, writer);
  pixel.geometry->accel->occluded(rays_.rays);
  return writer.known.color + sum_free(rays_, 0, rays_.size()).color;
}

}  // namespace baton
