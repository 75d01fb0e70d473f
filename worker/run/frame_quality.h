#pragma once

#include "common/base/team.h"
#include "common/image/film_tile.h"
#include "common/job/task.h"

namespace baton {

/// Judges a whole finished film: its R, G, B, and the noise that its errors tell
/// (common/image/noise.h). The same whoever is lent.
FrameQuality judge_frame(const FilmTile& image, const Lend& lend = lend_nobody);
/// Judges a film that was laid over a plate and was `rendered` before: noise, mean and very bright
/// pixels are those of the composite, values below zero those of what was rendered.
FrameQuality judge_composite(const FilmTile& image, const FrameQuality& rendered,
                             const Lend& lend = lend_nobody);

/// Sets what is below zero in R, G and B to 0. This adds FrameQuality::light_below_zero of the
/// light.
void clamp_negative(FilmTile& image);

}  // namespace baton
