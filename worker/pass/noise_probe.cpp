#include "worker/pass/noise_probe.h"

#include "common/base/poison.h"

namespace baton {

float NoiseProbe::sample_again(const PixelMethod& method, const PixelInput& input,
                               const FrameLight& light, SampleState& state, std::size_t index,
                               const SiteOrigins& origins, SamplerScratch& scratch) {
  // Start from what the pixel remembers, in a state of its own.
  state_.resize({0, 0, 1, 1}, state.num_particles, state.num_populations);
  if (const PixelMemory* memory = state.memory_of(index)) {
    state_.add_memory();
    state_.memory[0] = *memory;
  }
  target_.resize(static_cast<std::size_t>(state.num_particles));

  // Sample with other random numbers.
  RngKey key = input.key;
  key.round = static_cast<std::uint32_t>(kProbeRound) - key.round;
  const PixelInput again{.sites = input.sites,
                         .light = light,
                         .now = input.now,
                         .before = input.before,
                         .key = key,
                         .frame_index = input.frame_index,
                         .has_history = input.has_history,
                         .target = target_,
                         .hits = input.hits,
                         .geometry = input.geometry};
  rays_.clear();
  RayWriter writer(origins, rays_);
  poison(scratch);
  method.sample(again, {state_, 0}, scratch, writer);

  // Trace and add up.
  input.geometry->accel->occluded(rays_.rays);
  return mean(writer.known.color + sum_free(rays_, 0, rays_.size()).color);
}

}  // namespace baton
