#pragma once

#include "worker/surface/site_block.h"

namespace baton {

/// The surfaces that carried samples come from, where they are not those that the pixel sees now:
/// camera or objects moved. Each site t of this frame that sees a surface inherits the samples of
/// one site g(t) of an old pixel; a sample at old site s goes to one of the T(s) sites that inherit
/// it, drawn uniformly. So at a site of this frame the density of the old samples is p~_{n-1} of
/// surface g(t) over T(g(t)), whatever g is: the weights stay right for any choice.
struct OldSurfaces {
  /// By site of this frame: the surface of g(t).
  SiteBlock sites;
  SiteBlock::Array log_share{};  ///< -log T(g(t))
};

}  // namespace baton
