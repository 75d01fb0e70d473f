#include "common/scene/pose.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/job/motion.h"
#include "common/math/inverse.h"

namespace baton {
namespace {

/// The triangle of a point in a pose.
class PlacedTriangle {
 public:
  PlacedTriangle(const Scene& scene, const Pose& pose, const InstancePoint& point)
      : instance_(pose.instances[point.instance]),
        vertices_(vertices_of(scene, pose.shapes, instance_.mesh)),
        corner_(scene.meshes[instance_.mesh].triangles[point.place.triangle]),
        place_(point.place) {}

  Vec3 position() const { return mix(world(0), world(1), world(2)); }
  /// The interpolated normal, or that of the face where vertices have none.
  Vec3 normal() const {
    const std::span<const Vec3> n = vertices_.normals;
    if (n.empty()) return normalize(cross(world(1) - world(0), world(2) - world(0)));
    return normalize(instance_.normal_to_world * mix(n[corner_[0]], n[corner_[1]], n[corner_[2]]));
  }

 private:
  Vec3 world(std::size_t k) const {
    return instance_.to_world.point(vertices_.positions[corner_[k]]);
  }
  Vec3 mix(const Vec3& a, const Vec3& b, const Vec3& c) const {
    return a * (1 - place_.u - place_.v) + b * place_.u + c * place_.v;
  }

  const Instance& instance_;
  const MeshVertices vertices_;
  const std::array<std::uint32_t, 3>& corner_;
  const SurfacePlace& place_;
};

/// Shapes of the meshes that deform.
MeshShapes shapes_at(const Scene& scene, double frame) {
  MeshShapes shapes;
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (scene.meshes[i].deformation == nullptr) continue;
    shapes.resize(i + 1);
    shapes[i] = std::make_shared<const MeshShape>(scene.meshes[i].shape_at(frame));
  }
  return shapes;
}

/// Largest element of the inverse of a map that rays are taken through: float32 then holds its
/// determinant, and places of up to a million units in the space of a mesh.
constexpr float kMostInverse = 1e12f;

/// Inverse transpose of a map from a mesh to the world; none where rays cannot be taken back.
std::optional<Mat3> normal_map(const Mat3& to_world) {
  const std::optional<Mat3> normals = inverse_transposed(to_world);
  const auto is_far = [](float x) { return std::fabs(x) > kMostInverse; };
  return normals && std::ranges::any_of(normals->m, is_far) ? std::nullopt : normals;
}

}  // namespace

Pose pose_at(const Scene& scene, const JobSpec& job, double frame) {
  Pose pose{Camera(camera_at(job, frame), job.image.width, job.image.height), scene.instances,
            shapes_at(scene, frame)};
  for (Instance& instance : pose.instances) {
    if (instance.moving_object < 0) continue;
    const ObjectSpec& object = job.scene.objects[static_cast<std::size_t>(instance.moving_object)];
    const Transform motion = object_motion_at(object, job.motion.curve, frame);
    const Transform rest = instance.to_world;
    instance.to_world.linear = motion.linear * rest.linear;
    instance.to_world.offset =
        motion.linear * (rest.offset - object.translate) + object.translate + motion.offset;
    const std::optional<Mat3> normals = normal_map(instance.to_world.linear);
    instance.normal_to_world = normals.value_or(Mat3{});
    instance.is_absent = !normals;
  }
  return pose;
}

Vec3 carry_point(const Scene& scene, const Pose& from, const Pose& to, const InstancePoint& point) {
  const Instance &here = from.instances[point.instance], &there = to.instances[point.instance];
  if (here.deforms) return PlacedTriangle(scene, to, point).position();
  const Mat3 to_mesh = here.normal_to_world.transposed();
  return there.to_world.point(to_mesh * (point.world - here.to_world.offset));
}

Vec3 carry_normal(const Scene& scene, const Pose& from, const Pose& to,
                  const InstancePoint& normal) {
  const Instance &here = from.instances[normal.instance], &there = to.instances[normal.instance];
  if (here.deforms) {
    const Vec3 carried = PlacedTriangle(scene, to, normal).normal();
    return dot(PlacedTriangle(scene, from, normal).normal(), normal.world) < 0 ? -carried : carried;
  }
  return normalize(there.normal_to_world * (here.to_world.linear.transposed() * normal.world));
}

}  // namespace baton
