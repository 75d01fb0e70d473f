#pragma once

#include <vector>

#include "worker/scene/camera.h"
#include "worker/scene/scene.h"

namespace baton {

/// Where camera and objects are in one frame.
struct Pose {
  Camera camera;
  std::vector<Instance> instances;  ///< those of the scene, in its order, moved
};

/// The pose at a frame number: a pure function of the job. scene: that of the job, with motion as
/// keys.
Pose pose_at(const Scene& scene, const JobSpec& job, double frame);

/// Where a point of an instance that is at `world` in one pose is in another one.
Vec3 carry_point(const Instance& from, const Instance& to, const Vec3& world);
/// The same for a unit normal; unit.
Vec3 carry_normal(const Instance& from, const Instance& to, const Vec3& world);

}  // namespace baton
