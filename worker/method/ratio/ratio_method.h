#pragma once

#include "worker/method/pixel_method.h"

namespace baton {

/// The ratio estimator [Heitz, Hill & McGuire 2018]: the pixel without shadows, known well, times
/// the ratio of a shadowed to an unshadowed estimate from the same few rays, channel by channel.
/// The unshadowed pixel of the original is analytic, for area lights; here it is the sum of the M
/// candidates, of which N become rays as in `bidirectional`. What the choice of N does to the
/// colour cancels; under grey light on grey surfaces the two methods are one. Consistent, not
/// unbiased: a ratio of two estimates, off at finite N where the colours of the samples differ. It
/// carries nothing.
PixelMethod make_ratio_method(const JobSpec& job);

}  // namespace baton
