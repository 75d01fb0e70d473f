#pragma once

#include "common/job/job_spec.h"
#include "worker/scene/environment.h"
#include "worker/scene/scene.h"

namespace baton {

/// Light from below the ground reaches no surface that a camera above it sees: the ground is in the
/// way. The directions for which that holds at every point of the scene, at every frame between the
/// first key and the last, as a cone of the map: nothing need be sampled there, and no picture
/// changes but in its noise. With H the height of the scene above the ground and R its farthest
/// extent along x or z, a ray within atan((size / 2 - R) / H) of straight down ends on the ground.
///
/// None for a ground that lets light through (shadow catcher, holes), for a camera below it or
/// beside it, and for a map that turns about an axis that is not vertical. scene: that of the job,
/// which is settled (settle_motion.h). A function of the job without its list of frames: a longer
/// sequence starts with the same pictures.
HiddenCone hidden_light(const JobSpec& job, const Scene& scene);

}  // namespace baton
