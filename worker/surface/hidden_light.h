#pragma once

#include <optional>
#include <vector>

#include "common/job/job_spec.h"
#include "common/math/bounds.h"
#include "common/scene/scene.h"
#include "worker/surface/environment.h"

namespace baton {

/// Light from below the ground reaches no surface that a camera above it sees: the ground is in the
/// way. The directions for which that holds at every point of the scene, as a cone of the map:
/// nothing need be sampled there, and no picture changes but in its noise. With H the height of the
/// scene above the ground and R its farthest extent along x or z, a ray within atan((size / 2 - R)
/// / H) of straight down ends on the ground.
///
/// None for a ground that lets light through (shadow catcher, holes), for a camera below it or
/// beside it, and for a map that turns about an axis that is not vertical.
class HiddenLight {
 public:
  /// job: with motion as keys; it and its scene must outlive the object.
  HiddenLight(const JobSpec& job, const Scene& scene);

  /// The cone of a frame, a pure function of what the frame shows. Its angle is one of a few, so
  /// that most frames of a sequence share a map.
  HiddenCone at(FrameNumber frame) const;

 private:
  const JobSpec& job_;
  const Scene& scene_;
  /// Straight down in the map's own frame; none: nothing is hidden.
  std::optional<Vec3> down_;
  std::vector<Bounds> boxes_;  ///< (meshes) around each, in its own space
};

}  // namespace baton
