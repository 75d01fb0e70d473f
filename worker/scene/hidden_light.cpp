#include "worker/scene/hidden_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/job/motion.h"
#include "common/job/sequence.h"
#include "worker/scene/pose.h"
#include "worker/scene/surface_detail.h"

namespace baton {
namespace {

/// Instances times frames that are looked at.
constexpr double kMostPlaced = 2e6;
/// Of the angle, for what is rounded on the way.
constexpr float kMargin = 1e-3f;

struct Box {
  Vec3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  static constexpr float kFar = std::numeric_limits<float>::max();

  void add(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Vec3 corner(unsigned i) const {
    return {(i & 1) ? high.x : low.x, (i & 2) ? high.y : low.y, (i & 4) ? high.z : low.z};
  }
};

/// The numbers of all frames at which something can be elsewhere than at another; one, where
/// nothing moves.
std::pair<double, double> frames_in_motion(const JobSpec& job) {
  double first = std::numeric_limits<double>::max(), last = -first;
  const auto add = [&](const auto& keys) {
    for (const auto& key : keys) {
      first = std::min(first, std::floor(key.frame));
      last = std::max(last, std::ceil(key.frame));
    }
  };
  add(job.camera.keys);
  for (const ObjectSpec& object : job.scene.objects) add(object.keys);
  if (first > last) return {0, 0};
  return {first, last};
}

/// How far from the camera's position its rays may start.
float reach_of(const CameraSpec& camera, const ImageSpec& image) {
  float reach = 0.5f * camera.aperture;
  if (camera.projection == Projection::orthographic) {
    const float aspect = static_cast<float>(image.width) / static_cast<float>(image.height);
    reach += camera.orthographic_height *
             (0.5f * (1 + aspect) + std::fabs(camera.shift[0]) + std::fabs(camera.shift[1]));
  }
  return reach;
}

/// Where the map's own frame has straight down, if that is the same in all frames.
std::optional<Vec3> down_in_map(const EnvironmentSpec& environment) {
  const Vec3 axis = environment.rotation_axis;
  const bool is_vertical = axis.x == 0 && axis.z == 0;
  const auto other = std::ranges::adjacent_find(environment.rotation_keys,
                                                std::ranges::not_equal_to(), &NumberKey::value);
  const bool turns =
      environment.rotation_deg_per_frame != 0 || other != environment.rotation_keys.end();
  if (turns && !is_vertical) return std::nullopt;
  return is_vertical ? Vec3{0, -1, 0}
                     : environment_at(environment, 0).rotation.transposed() * Vec3{0, -1, 0};
}

/// Adds all that is not the ground to `box`, as it is placed in a pose.
void add_instances(const Pose& pose, const std::vector<Box>& meshes, bool only_moving, Box& box) {
  for (std::size_t i = 0; i + 1 < pose.instances.size(); ++i) {
    const Instance& instance = pose.instances[i];
    if (only_moving && !instance.moves()) continue;
    for (unsigned corner = 0; corner < 8; ++corner)
      box.add(instance.to_world.point(meshes[instance.mesh].corner(corner)));
  }
}

}  // namespace

HiddenCone hidden_light(const JobSpec& job, const Scene& scene) {
  // A ground that stops light, which load_scene puts last.
  if (!job.scene.ground || job.scene.ground->catcher) return {};
  const Material& material = scene.material_of(scene.instances.back());
  if (material.detail != nullptr && material.detail->is_cut_out()) return {};
  const std::optional<Vec3> down = down_in_map(job.environment);
  const auto [first, last] = frames_in_motion(job);
  if (!down || (last - first) * static_cast<double>(scene.instances.size()) > kMostPlaced)
    return {};

  std::vector<Box> meshes(scene.meshes.size());
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    for (const Vec3& position : scene.meshes[i].positions) meshes[i].add(position);
  }

  // A camera that looks from above the ground sees nothing below it.
  const GroundSpec& ground = *job.scene.ground;
  Box box;
  for (double frame = first; frame <= last; ++frame) {
    const CameraSpec camera = camera_at(job, frame);
    const float reach = reach_of(camera, job.image);
    const float aside = std::max(std::fabs(camera.position.x), std::fabs(camera.position.z));
    if (!(camera.position.y - reach > ground.height && aside + reach < 0.5f * ground.size))
      return {};
    add_instances(pose_at(scene, job, frame), meshes, frame > first, box);
  }

  // From its highest point, at its farthest, down to the edge of the ground.
  if (box.high.y <= ground.height) return {};
  const float aside = std::max({-box.low.x, -box.low.z, box.high.x, box.high.z});
  const float angle =
      std::atan((0.5f * ground.size - aside) / (box.high.y - ground.height)) - kMargin;
  return {.axis = {down->x, down->y, down->z}, .angle = std::max(angle, 0.0f)};
}

}  // namespace baton
