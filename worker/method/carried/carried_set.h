#pragma once

#include <cstdint>
#include <span>

#include "common/math/octahedral.h"
#include "worker/method/carried/old_surfaces.h"

namespace baton {

/// The samples that a pixel had in the frame before, borrowed from its state, (N) each: a properly
/// weighted set for the target of then.
struct CarriedSet {
  std::span<const OctDirection> direction;
  std::span<const std::uint8_t> site;  ///< sites of the pixel that uses the samples
  std::span<const float> weight;       ///< sum 1, or all 0
  float lns = 0;
  std::uint16_t confidence = 0;  ///< confidence_plane()
  /// What the samples were drawn for; null: what is seen now.
  const OldSurfaces* surfaces = nullptr;
};

}  // namespace baton
