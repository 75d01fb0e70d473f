#include "worker/pass/noise_probe.h"

namespace baton {

Rgb NoiseProbe::sample_again(const PixelMethod& method, const PixelInput& input,
                             const FrameLight& light, const PresampledLight& presampled,
                             SampleState& state, std::size_t index, const SiteOrigins& origins,
                             SamplerScratch& scratch) {
  RngKey key = input.key;
  key.round = static_cast<std::uint32_t>(kProbeRound.value()) - key.round;
  const AsideSampler::Aside again{.sites = input.sites,
                                  .hits = input.hits,
                                  .origins = origins,
                                  .light = light,
                                  .presampled = presampled,
                                  .key = key,
                                  .memory = state.memory_of(index)};
  return aside_.sample(method, input, again, state, scratch);
}

}  // namespace baton
