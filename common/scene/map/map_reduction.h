#pragma once

#include <array>

#include "common/image/image_io.h"

namespace baton {

/// Columns and rows of what make_map makes of a picture with these sides. max_width: 0: any.
std::array<int, 2> map_sides(int width, int height, int max_width);

/// A lat-long map as `width` columns and round(height * width / its width) rows, at least one. Each
/// texel is the mean of the radiance, times `scale`, over its part of the sphere: texels of the map
/// that lie across its edges count for the solid angle inside, so the power of the map, and of
/// every box, is kept for any sizes (texels taken as constant). width: [1, the map's).
RgbImage reduce_map(const RgbImage& map, int width, float scale);

}  // namespace baton
