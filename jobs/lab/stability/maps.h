#pragma once

#include "common/image/image_io.h"

namespace baton::stability {

/// The suite's environment maps, made by code so that the exact answer is known. Radiance is
/// dimensionless.

/// A bright window, a coloured lamp and a small hard sun over a dim graded sky and a dark ground,
/// 64 x 32.
RgbImage studio_map();
/// A smooth grey sky without any feature sharper than a hemisphere, 64 x 32.
RgbImage overcast_map();
/// studio_map with another window and no sun: what a cut changes to, 64 x 32.
RgbImage other_map();
/// overcast_map at a hundredth with, if `lit`, a lamp of 2 x 2 texels of radiance 40, 64 x 32.
RgbImage dusk_map(bool lit);
/// Black, 64 x 32.
RgbImage black_map();
/// Black but for one texel, 64 x 32.
RgbImage lit_texel_map();
/// Five hard-edged panels, all capped at 8, on black, 64 x 32.
RgbImage panels_map();
/// A sky of radiance 1 and a sun of 1e5 in two texels, 128 x 64.
RgbImage two_texel_sun_map();
/// studio_map with NaN, infinite and negative texels. `repaired`: the same with zeros in their
/// place.
RgbImage broken_map(bool repaired);
/// A dim sphere of light with one panel of 4 x 4 texels, 64 x 32: a light that sets and rises.
RgbImage lone_panel_map();

}  // namespace baton::stability
