#pragma once

#include <span>

namespace baton {

/// sRGB's curve [IEC 61966-2-1] of a linear value, clamped to [0, 1]; NaN is 0.
float encode_srgb(float linear);

/// The exposure at which the mean of encode_srgb over `values` is .4, within a millionth: the one
/// that errors "as shown" are taken at. 1 where no value is above 0. Values at which no exposure
/// does it (nearly all are black) get the largest of [1e-9, 1e9].
double exposure_as_shown(std::span<const float> values);

}  // namespace baton
