#pragma once

#include "common/job/job_spec.h"
#include "common/scene/scene.h"

namespace baton {

/// The share of the job's pixels that see a surface, [0, 1], of its first, middle and last frame
/// the largest. From a small picture without a ray tracer; holes in textures count as surface, and
/// so do triangles that reach behind the eye as nothing, but for the ground.
double surface_share(const JobSpec& job, const Scene& scene);

}  // namespace baton
