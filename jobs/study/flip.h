#pragma once

#include <vector>

#include "common/image/image_io.h"

namespace baton {

/// Pixels per degree of sight at the published default: 0.7 m from a 0.7 m wide screen of 3840.
inline constexpr double kFlipPixelsPerDegree = 67.020643;

/// LDR-FLIP [Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"]: how
/// large a person finds the difference when two images flip in place, per pixel, in [0, 1], 0 for
/// equal ones. Both images are linear display RGB in [0, 1] (tone_map makes it) and have one size.
/// Returns (height, width). Borders are extended by their last pixel.
std::vector<float> flip_difference(const RgbImage& reference, const RgbImage& test,
                                   double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace baton
