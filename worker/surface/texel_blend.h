#pragma once

#include <array>
#include <cstdint>

#include "common/scene/texture/texture.h"

namespace baton {

/// Blends along the longer side of a footprint.
inline constexpr int kMostProbes = 16;

/// Points along the middle of a footprint whose mean is looked up; each blends two levels.
struct ProbeLine {
  std::array<float, 2> middle{}, along{};  ///< in units of the whole image
  int num_probes = 1;                      ///< [1, kMostProbes]
  TextureLevel fine, coarse;
  float blend = 0;  ///< share of the coarse level, [0, 1)
  /// Texels are smaller than the footprint: always blended.
  bool is_smaller = false;
};

}  // namespace baton
