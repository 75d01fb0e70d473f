#pragma once

#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/scene/scene.h"

namespace baton {

/// A cheap look at a job's scene in its first frame, as display colours: on the left what the
/// camera sees, on the right all of it from outside, with the camera's view as lines. Objects are
/// flat coloured and have their numbers, names and bounds; x is red, y green, z blue; axes are as
/// long as the scene's objects are large, in a power of ten. scene: the job's, with settled motion.
RgbImage scene_preview(const JobSpec& job, const Scene& scene);

/// One line an object: its number, mesh, material, size and place in the first frame.
std::vector<std::string> object_lines(const JobSpec& job, const Scene& scene);

}  // namespace baton
