#pragma once

#include "common/job/job_spec.h"
#include "common/math/vec3.h"

namespace baton {

/// The camera of a still job goes round what it looks at by 2 degrees a frame.
inline void set_in_orbit(JobSpec& job) {
  const Vec3 arm = job.camera.position - job.camera.look_at;
  for (std::size_t i = 0; i < job.frames.size(); ++i) {
    job.camera.keys.push_back(
        {.frame = static_cast<double>(job.frames[i].value()),
         .position =
             job.camera.look_at + rotation_about(job.camera.up, 2.0 * static_cast<double>(i)) * arm,
         .look_at = job.camera.look_at,
         .up = job.camera.up});
  }
}

}  // namespace baton
