#pragma once

#include "common/math/vec3.h"

namespace baton {

/// What a site sends to the viewer of the light along one direction; all 0 where it sends nothing.
struct Reflected {
  Rgb radiance;      ///< (f cos L)_rgb
  float target = 0;  ///< p~_s(w): its mean over RGB
};

}  // namespace baton
