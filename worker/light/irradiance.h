#pragma once

#include "worker/scene/environment.h"

namespace baton {

/// Integral of L max(0, n.w) over the sphere, per channel: what a surface with unit normal n
/// receives without shadows. Small maps are integrated between their texels, as they are
/// reconstructed.
Rgb irradiance(const Environment& environment, const Vec3& normal);

}  // namespace baton
