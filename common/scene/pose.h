#pragma once

#include <vector>

#include "common/scene/camera.h"
#include "common/scene/scene.h"

namespace baton {

/// Where camera and objects are in one frame, and in which shape.
struct Pose {
  Camera camera;
  std::vector<Instance> instances;  ///< those of the scene, in its order, moved
  MeshShapes shapes{};              ///< meshes that deform, in their shape
};

/// The pose at a frame number: a pure function of the job. scene: that of the job, with motion as
/// keys.
Pose pose_at(const Scene& scene, const JobSpec& job, double frame);

/// A point of an instance.
struct InstancePoint {
  std::uint32_t instance = 0;
  /// Needed where its mesh deforms; else not looked at.
  SurfacePlace place{};
  Vec3 world{};  ///< where it is, or a normal there
};
/// Where a point of an instance that moves, which is at `point.world` in one pose, is in another
/// one: where the instance has gone, and on the same place of the triangle.
Vec3 carry_point(const Scene& scene, const Pose& from, const Pose& to, const InstancePoint& point);
/// The same of a unit normal.
Vec3 carry_normal(const Scene& scene, const Pose& from, const Pose& to,
                  const InstancePoint& normal);

}  // namespace baton
