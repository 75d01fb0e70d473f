#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace baton {

/// Triangles without area, which are left out, of all meshes.
std::uint64_t count_dropped(const Scene& scene);

/// What people call an object: its name, such as that of its node, or else its mesh.
const std::string& label_of(const ObjectSpec& object);

/// What is odd about meshes and where objects are, one line each: triangles without area; objects
/// in no frame's picture, behind the camera, smaller than a pixel, or so far from the origin that
/// floats are more than an eighth of a pixel apart there. Looks at bounding boxes in at
/// most 100 of the job's frames. scene: the job's, with settled motion.
std::vector<std::string> geometry_warnings(const JobSpec& job, const Scene& scene);

}  // namespace baton
