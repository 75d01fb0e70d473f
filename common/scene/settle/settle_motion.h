#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// Makes a job ready to be submitted, so that all that comes after is a function of its document:
/// a scene that is in a glTF file becomes objects (settle_scene.h), motion that is in glTF files
/// becomes keys, one a frame, and motion.max_px, where it is 0, is measured between the first key
/// and the last. A job without glTF files in which nothing moves comes back as it is. Errors: those
/// of load_scene, a glTF file or a node of it that is not there. left_out: as settle_scene has it.
Result<JobSpec> settle_motion(JobSpec job, std::vector<std::string>* left_out = nullptr);

}  // namespace baton
