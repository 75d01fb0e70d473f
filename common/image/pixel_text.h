#pragma once

#include <string_view>

#include "common/image/image_io.h"

namespace baton {

/// Side of a dot of a letter.
inline constexpr int kDotPixels = 2;

/// Size of what draw_text writes, in pixels.
int text_width(std::string_view text);
int text_height();

/// Writes small white letters into a black box whose lower left corner is (left, bottom); what does
/// not fit into the image is cut off. Letters have no case; what has no letter shows as '?'.
void draw_text(std::string_view text, int left, int bottom, RgbImage& image);

}  // namespace baton
