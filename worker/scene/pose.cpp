#include "worker/scene/pose.h"

#include "common/job/motion.h"
#include "common/math/inverse.h"

namespace baton {

Pose pose_at(const Scene& scene, const JobSpec& job, double frame) {
  Pose pose{Camera(camera_at(job, frame), job.image.width, job.image.height), scene.instances};
  for (Instance& instance : pose.instances) {
    if (!instance.moves()) continue;
    const ObjectSpec& object = job.scene.objects[static_cast<std::size_t>(instance.moving_object)];
    const Transform motion = object_motion_at(object, job.motion.curve, frame);
    const Transform rest = instance.to_world;
    instance.to_world.linear = motion.linear * rest.linear;
    instance.to_world.offset =
        motion.linear * (rest.offset - object.translate) + object.translate + motion.offset;
    // Scales are positive and rotations rigid: no motion is singular, unless it leaves the range of
    // floats.
    instance.normal_to_world = inverse_transposed(instance.to_world.linear).value_or(Mat3{});
  }
  return pose;
}

Vec3 carry_point(const Instance& from, const Instance& to, const Vec3& world) {
  const Mat3 to_mesh = from.normal_to_world.transposed();
  return to.to_world.point(to_mesh * (world - from.to_world.offset));
}

Vec3 carry_normal(const Instance& from, const Instance& to, const Vec3& world) {
  return normalize(to.normal_to_world * (from.to_world.linear.transposed() * world));
}

}  // namespace baton
