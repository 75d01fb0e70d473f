#pragma once

#include "common/state/first_pass_samples.h"

namespace baton::test {

/// 5 x 4 pixels of 8 samples in two populations; pixel (1, 1) has a failed ray.
inline FirstPassSamples small_first_pass() {
  FirstPassSamples s;
  s.picture = {3, 4};
  s.step = Step(2);
  s.tile = 1;
  s.rect = {10, 20, 15, 24};
  s.num_slots = 8;
  s.num_populations = 2;
  s.flags.assign(20, FirstPassSamples::kSurface);
  s.flags[6] |= FirstPassSamples::kFailed[1];
  s.count.assign(20, 2);
  for (std::uint32_t i = 0; i < 40; ++i) {
    s.slot.push_back(static_cast<std::uint8_t>(i % 2 == 0 ? 1 : 6));
    s.site.push_back(static_cast<std::uint8_t>(i % 4));
    s.direction.push_back(i * 2654435761u);
    s.energy.push_back(0.5f + static_cast<float>(i));
  }
  return s;
}

}  // namespace baton::test
