#pragma once

#include <array>

#include "common/job/job_spec.h"

namespace baton {

/// Weight of the light that arrives `distance` pixels from a pixel's centre along one axis, up to a
/// factor; the filter is the product over both. blackman_harris: Harris 1978, 4 terms; gaussian:
/// exp(-2 (d / .75)^2). 0 from filter_radius() on.
double filter_weight(PixelFilter filter, double distance);
/// Pixels.
double filter_radius(PixelFilter filter);

/// A position drawn from the filter, relative to the pixel's upper left corner, in pixels: the
/// inverse of its cumulative distribution along each axis. u: uniform, [0, 1)^2. All samples then
/// count alike, so no sum mixes pixels [Ernst et al. 2006, "Filter importance sampling"].
std::array<float, 2> filter_position(PixelFilter filter, const std::array<float, 2>& u);

}  // namespace baton
