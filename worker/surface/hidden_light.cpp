#include "worker/surface/hidden_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "common/scene/pose.h"
#include "worker/surface/seen_surface.h"

namespace baton {
namespace {

/// Degrees; each costs a sequence a map at most.
constexpr std::array kAngles{89, 88, 87, 85, 83, 80, 75, 70, 60, 45, 30};

Bounds bounds_of(std::span<const Vec3> points) {
  Bounds bounds;
  for (const Vec3& point : points) bounds.add(point);
  return bounds;
}

/// How far from the camera's position its rays may start.
float reach_of(const CameraSpec& camera, const ImageSpec& image) {
  float reach = 0.5f * camera.aperture;
  if (camera.projection == Projection::orthographic) {
    const auto pictures = [&](int pixels) {
      return static_cast<float>(pixels) / static_cast<float>(image.height);
    };
    const Overscan& around = image.overscan;
    reach += camera.orthographic_height *
             (0.5f * (1 + pictures(image.width)) + std::fabs(camera.shift[0]) +
              std::fabs(camera.shift[1]) + pictures(std::max(around.left, around.right)) +
              pictures(std::max(around.top, around.bottom)));
  }
  return reach;
}

/// Whether the camera is above the ground: then it sees nothing that is below.
bool looks_from_above(const JobSpec& job, FrameNumber frame) {
  const GroundSpec& ground = *job.scene.ground;
  const CameraSpec camera = camera_at(job, frame.value());
  const float reach = reach_of(camera, job.image);
  const float aside = std::max(std::fabs(camera.position.x), std::fabs(camera.position.z));
  return camera.position.y - reach > ground.height && aside + reach < 0.5f * ground.size;
}

/// Whether the scene has a ground that all light stops at. load_scene puts it last.
bool has_solid_ground(const JobSpec& job, const Scene& scene) {
  if (!job.scene.ground || job.scene.ground->catcher) return false;
  const auto& detail = scene.material_of(scene.instances.back()).detail;
  return detail == nullptr || !detail->is_cut_out();
}

/// Straight down in the map's own frame, if that is the same in all frames.
std::optional<Vec3> down_in_map(const EnvironmentSpec& environment) {
  const Vec3 down{0, -1, 0};
  if (environment.rotation_axis.x == 0 && environment.rotation_axis.z == 0) return down;
  if (environment.rotation_deg_per_frame != 0 || !environment.rotation_keys.empty())
    return std::nullopt;
  return environment_at(environment, FrameNumber(0)).rotation.transposed() * down;
}

}  // namespace

HiddenLight::HiddenLight(const JobSpec& job, const Scene& scene) : job_(job), scene_(scene) {
  if (has_solid_ground(job, scene)) down_ = down_in_map(job.environment);
  if (!down_) return;
  for (const TriangleMesh& mesh : scene.meshes) boxes_.push_back(bounds_of(mesh.positions));
}

HiddenCone HiddenLight::at(FrameNumber frame) const {
  if (!down_ || !looks_from_above(job_, frame)) return {};

  // The highest point and the farthest one of all that stands on the ground.
  float height = 0, aside = 0;
  const Pose pose = pose_at(scene_, job_, frame.value());
  for (std::size_t i = 0; i + 1 < pose.instances.size(); ++i) {
    const std::uint32_t mesh = pose.instances[i].mesh;
    const Bounds box = pose.instances[i].deforms
                           ? bounds_of(vertices_of(scene_, pose.shapes, mesh).positions)
                           : boxes_[mesh];
    for (std::size_t k = 0; k < 8; ++k) {
      const Vec3 corner = pose.instances[i].to_world.point(box.corner(k));
      height = std::max(height, corner.y - job_.scene.ground->height);
      aside = std::max({aside, std::fabs(corner.x), std::fabs(corner.z)});
    }
  }
  const float ground_left = 0.5f * job_.scene.ground->size - aside;
  for (const int degrees : kAngles) {
    const float angle = static_cast<float>(degrees) * kPi / 180;
    if (std::tan(angle) * height < ground_left)
      return {.axis = {down_->x, down_->y, down_->z}, .angle = angle};
  }
  return {};
}

}  // namespace baton
