#include "worker/pass/noise_probe.h"

namespace baton {

Rgb NoiseProbe::sample_again(const PixelMethod& method, const PixelInput& input,
                             const RoundLight& light, const PresampledLight& presampled,
                             const PixelState& pixel, const SiteOrigins& origins) {
  return aside_.sample(method, input,
                       {.sites = input.sites,
                        .hits = input.hits,
                        .origins = origins,
                        .light = light,
                        .presampled = presampled,
                        .key = probe_key(input.key)},
                       pixel);
}

}  // namespace baton
