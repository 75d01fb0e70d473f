#pragma once

// What a block's memory says, read by the sampler's own code for this program's instruction set.
#include "common/math/octahedral.h"
#include "worker/sampling/pool-inl.h"

namespace baton {

/// The bin of a direction of the sky, or of a lamp.
inline std::size_t visibility_bin(OctDirection code, bool is_lamp = false) {
  using namespace HWY_NAMESPACE;
  const float inverse_density = (is_lamp ? 0.99f : 1.01f) / kLampDensity;
  return static_cast<std::size_t>(
      hn::GetLane(BinsOf(hn::Set(DU(), code), hn::Set(DF(), inverse_density))));
}

inline VisibilityTable table_of(const BlockMemory& memory) {
  VisibilityTable table;
  table.read(memory, PoolTuning{}.prior_rays);
  return table;
}

/// V^ of a direction.
inline float expected_visibility(const BlockMemory& memory, OctDirection code,
                                 bool is_lamp = false) {
  using namespace HWY_NAMESPACE;
  const PoolTuning tuning;
  const VisibilityTable table = table_of(memory);
  const PixelVisibility pixel(table);
  const auto bin = static_cast<std::int32_t>(visibility_bin(code, is_lamp));
  return hn::GetLane(RememberedLanes(tuning, pixel).Look(hn::Set(DI(), bin)).expected);
}

inline void remember_ray(BlockMemory& memory, std::size_t bin, bool free) {
  const auto tag = static_cast<std::uint16_t>(bin);
  PixelMemory pixel;
  remember_rays({&tag, 1}, free ? 1 : 0, memory, pixel);
}

}  // namespace baton
