#pragma once

#include <array>
#include <span>

#include "common/image/image_io.h"

namespace baton {

/// The exposure at which the image's log-average luminance becomes middle grey, 0.18 [Reinhard et
/// al. 2002, eq. 1]. Only finite pixels brighter than 0 count, so black surroundings do not matter;
/// 1 when there are none.
float auto_exposure(const RgbImage& image);

/// Linear RGB to linear display RGB in [0, 1]: times `exposure`, then extended Reinhard [2002, eq.
/// 4] with white at 8 times the diffuse white. Dark colours keep their hue (the curve is applied to
/// luminance), bright ones fade to white (it is applied per channel). Negative and not finite
/// values count as 0.
RgbImage tone_map(const RgbImage& image, float exposure);

/// Copies a crop (x, y, width, height) with its corner at (left, top), each pixel as a square of
/// `scale` pixels.
void paste(const RgbImage& from, const std::array<int, 4>& crop, int scale, int left, int top,
           RgbImage& to);

/// The image `width` pixels wide, height by its aspect, shrunk with a box filter; an enlarged pixel
/// stays a rectangle.
RgbImage resize(const RgbImage& image, int width);

/// All frames in reading order on one sheet of `columns` columns, `thumb_width` pixels wide each
/// (height by the aspect of the first frame), 2 pixel gaps between and around them in dark grey.
/// Frames are resized as by resize(). All frames
/// must have one size; `frames` must not be empty. numbers: of the frames, drawn white on black
/// into their lower left corners; none: empty.
RgbImage contact_sheet(std::span<const RgbImage> frames, int columns, int thumb_width,
                       std::span<const int> numbers = {});

}  // namespace baton
