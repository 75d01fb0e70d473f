#pragma once

#include <string>

#include "common/base/result.h"
#include "common/scene/texture/texture.h"

namespace baton {

/// Makes the colours of an image those that materials take: of Rec. 709, white to white, where its
/// file says another color space; base colors that are multiplied by alpha divided by it, where it
/// is above 0. Numbers and alpha stay. `name` goes first in the error: chromaticities of no color
/// space.
Status to_linear_colors(Image& image, TextureUse use, const std::string& name);

}  // namespace baton
