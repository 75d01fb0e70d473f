#pragma once

#include <cstdint>
#include <span>

#include "common/state/pixel_memory.h"

namespace baton {

/// Enters traced rays into a pixel's memory, one after the other: ray j in bin[j], free where bit j
/// of `free` is set; at most 64. A bin's first guess, worth one ray, is the share of all rays; from
/// the sixteenth ray on a new one counts 1/17, so that old ones fade.
void remember_rays(PixelMemory& memory, std::span<const std::uint8_t> bin, std::uint64_t free);

}  // namespace baton
