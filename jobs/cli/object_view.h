#pragma once

#include <string>
#include <vector>

#include "worker/scene/scene.h"

namespace baton {

/// What is odd about where objects are, one line each: in no frame's picture, behind the camera,
/// smaller than a pixel. Looks at bounding boxes in at most 100 of the job's frames. scene: the
/// job's, with settled motion.
std::vector<std::string> object_warnings(const JobSpec& job, const Scene& scene);

}  // namespace baton
