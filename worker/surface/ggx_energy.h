#pragma once

#include "common/math/vec3.h"
#include "worker/surface/bsdf.h"

namespace baton {

/// How much of the diffuse part of a ggx material is left where its share that is no metal would
/// reflect more than it receives, per channel, [0, 1]. Seen at grazing angles the lobe reflects
/// nearly everything, and glTF's diffuse part, which gives way to the lobe by the half vector
/// alone, comes on top of that. With what is left both together reflect all of a white sky, no
/// more. cos_view: between normal and view, > 0. A table of the lobe's albedo [Karis 2013] is made
/// at the first call (20 ms).
Rgb diffuse_left(const Material& material, float cos_view);

}  // namespace baton
