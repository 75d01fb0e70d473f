#pragma once

#include <cstddef>

#include "common/state/pixel_memories.h"

namespace baton {

/// Writes those of the kCount bins that are not 0, in order, to `cells`, which has room for kCount
/// (what lies behind those written may change), and which they are to `mask`. Returns their number.
std::size_t compress_bins(const VisibilityCell* bins, PixelMemories::BinMask& mask,
                          VisibilityCell* cells);

}  // namespace baton
