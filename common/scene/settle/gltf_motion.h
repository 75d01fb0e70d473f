#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/scene/gltf/node_motion.h"

namespace baton {

/// The frame numbers at which keys of a file are taken.
struct KeyFrames {
  std::vector<FrameNumber> frames;  ///< ascending
  /// With all from the first key of the animations to the last: those of every job of the shot.
  bool whole = false;
};
/// Each of a job's frames with the one before and the one behind, between which motion vectors lie,
/// so that what a frame shows does not depend on the others; and all of the animations, if these
/// are at most `most`.
KeyFrames key_frames(const gltf::NodeMotion& motion, const FileClock& clock,
                     const std::vector<FrameNumber>& frames, std::size_t most);

/// Replace `gltf` by keys at key_frames of a job's frames: where the file's animations have the
/// node then, in the world of the file. Errors name the file: missing, not a glTF file, no such
/// node, a node that no animation moves. left_out: gets what is odd about the animations.

/// The node must hold a camera, which also gives the angle of view.
Status take_camera_keys(const std::vector<FrameNumber>& frames, CameraSpec& camera,
                        std::vector<std::string>& left_out);
/// What the node does is done to the object.
Status take_object_keys(const std::vector<FrameNumber>& frames, ObjectSpec& object,
                        std::vector<std::string>& left_out);

/// Adds what is odd about the animations, unless it is said already.
void add_notes(const gltf::NodeMotion& motion, std::vector<std::string>& left_out);

/// Makes `camera` that of a node: with keys where it moves, at one place where it does not. frames:
/// of the job. Error: the node holds no camera.
Status put_camera(const gltf::NodeMotion& motion, int node, const FileClock& clock,
                  const std::vector<FrameNumber>& frames, CameraSpec& camera);

/// Keys of matrices, one a frame, but for those between equal ones. matrices: of `frames`.
std::vector<ObjectKey> matrix_keys(const std::vector<FrameNumber>& frames,
                                   const std::vector<Matrix34>& matrices);

}  // namespace baton
