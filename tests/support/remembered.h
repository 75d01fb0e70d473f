#pragma once

// What a pixel's memory says, read by the sampler's own code for this program's instruction set.
#include "common/math/octahedral.h"
#include "worker/sampling/pool-inl.h"
#include "worker/sampling/visibility_memory.h"

namespace baton {

inline std::size_t visibility_bin(OctDirection code) {
  using namespace HWY_NAMESPACE;
  return static_cast<std::size_t>(hn::GetLane(BinsOf(hn::Set(DU(), code))));
}

/// V^ of a direction.
inline float expected_visibility(const PixelMemory& memory, OctDirection code) {
  using namespace HWY_NAMESPACE;
  const PoolTuning tuning;
  return hn::GetLane(RememberedLanes(tuning, memory).Look(hn::Set(DU(), code)).expected);
}

inline void remember_ray(PixelMemory& memory, std::size_t bin, bool free) {
  const auto byte = static_cast<std::uint8_t>(bin);
  remember_rays(memory, {&byte, 1}, free ? 1 : 0);
}

}  // namespace baton
