#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// Replace `gltf` by keys, one for each frame number: where the file's first animation has the node
/// then, in the world of the file. Nodes that it does not move stay where the file puts them.
/// Errors name the file: missing, not a glTF file, no such node.

/// The node must hold a camera, which also gives the angle of view.
Status take_camera_keys(const std::vector<int>& frames, CameraSpec& camera);
/// The node's place, rotation and scale become the motion of the object.
Status take_object_keys(const std::vector<int>& frames, ObjectSpec& object);

}  // namespace baton
