#pragma once

#include <span>

#include "common/state/sample_state.h"

namespace baton {

/// The state of another tile of the same frame, cut and joined from the states that cover it.
/// Exact: no pixel's samples depend on the tile that it is in, so the bytes are those that
/// rendering the tile makes (tiles consist of whole blocks: TileGrid). parts: of one picture, frame
/// and layout. Errors (bad_input): parts that differ in that, or leave a pixel of `rect` uncovered.
Result<SampleState> join_states(std::span<const SampleState* const> parts, const PixelRect& rect,
                                std::int32_t tile);

}  // namespace baton
