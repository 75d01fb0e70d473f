#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// Puts what scene.gltf shows in its place: the materials of the file where the job has none of the
/// same name, a mesh for each primitive, an object for each node that shows one, with a matrix a
/// frame where an animation moves it, and the camera where the job takes one of the file. Lists the
/// files that glTF files refer to, and the tiles of textures, in scene.files. A job without any
/// comes back as it is.
/// left_out: gets a line for each node that is shown and has no volume in any frame, and for what
/// is odd about animations. Errors name file and node or material: not there, more than the limits,
/// not as glTF has them.
Status settle_scene(JobSpec& job, std::vector<std::string>* left_out = nullptr);

}  // namespace baton
