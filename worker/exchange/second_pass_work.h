#pragma once

#include <vector>

#include "worker/exchange/masked_surfaces.h"
#include "worker/exchange/pixel_mask.h"
#include "worker/exchange/sample_region.h"
#include "worker/pass/render_context.h"

namespace baton {

/// Who takes part in the second pass: in each fold, and in any of them; of one rectangle.
struct ExchangeMasks {
  std::vector<PixelMask> of_fold;
  PixelMask any;
};

/// What the second pass of a tile and frame works on.
struct SecondPassWork {
  const RenderContext& context;
  const FrameGeometry& geometry;
  const FrameSpec& frame;
  const FrameLight& light;
  const SampleRegion& samples;
  const ExchangeMasks& masks;
  const MaskedSurfaces& surfaces;  ///< surfaces of the pixels in masks.any
  const PixelRect& rect;           ///< pixels of the tile
};

}  // namespace baton
