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
/// Errors name file and node: not there, more than the limits, without extent in a frame.
Status settle_scene(JobSpec& job);

/// What is in the glTF files of a settled scene and is not shown, or not as there: one line each.
std::vector<std::string> gltf_warnings(const SceneSpec& scene);

}  // namespace baton
