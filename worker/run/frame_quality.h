#pragma once

#include "common/image/film_tile.h"
#include "common/job/task.h"

namespace baton {

/// Looks at a whole finished frame: R, G, B and, where the film has it, `variance` (squared error
/// of the mean of the three; 0: none). The noise then is the rms of that error over the mean
/// radiance, both over the pixels with an error: NoiseSource::halves.
///
/// Without `variance` it is told from how each pixel differs from the median of the eight around
/// it, in pixels whose alpha is not 0: NoiseSource::neighbors. The median goes along straight
/// edges, so that they do not count; texture, corners and thin things do. Of large frames every
/// k-th row is looked at. Sums are taken in the order of the pixels.
FrameQuality judge_frame(const FilmTile& image);

/// Sets what is below zero in R, G and B to 0. This adds FrameQuality::light_below_zero of the
/// light.
void clamp_negative(FilmTile& image);

}  // namespace baton
