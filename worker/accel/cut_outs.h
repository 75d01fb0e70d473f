#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <set>

#include "common/math/vec3.h"
#include "common/scene/scene.h"

/// Embree's side of surfaces that not every ray stops at: holes, and alpha that blends.
namespace baton {

/// Meshes that are cut out, somewhere at least.
std::set<std::uint32_t> meshes_with_holes(const Scene& scene);
/// Whether a surface blends: then rays need their bits as their ids.
bool any_blends(const Scene& scene);

/// Bits that belong to a ray alone, whatever is traced with it and however.
std::uint32_t ray_bits(const Vec3& origin, const Vec3& direction);

/// Filter function: lets rays pass where a surface is not there; for hits to count and for shadows
/// alike. geometryUserPtr: the Scene.
void pass_through_holes(const RTCFilterFunctionNArguments* args);

}  // namespace baton
