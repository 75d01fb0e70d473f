#include "jobs/cli/check/surface_share.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/job/motion.h"
#include "common/scene/pose.h"
#include "jobs/cli/check/preview_canvas.h"

namespace baton {
namespace {

constexpr int kWidth = 192;

bool sees_ground(const JobSpec& job, const Ray& ray) {
  if (!job.scene.ground || ray.direction.y == 0) return false;
  const GroundSpec& ground = *job.scene.ground;
  const float distance = (ground.height - ray.origin.y) / ray.direction.y;
  const Vec3 at = ray.origin + ray.direction * distance;
  return distance > 0 && std::max(std::abs(at.x), std::abs(at.z)) <= ground.size / 2;
}

double share_in(const JobSpec& job, const Scene& scene, FrameNumber frame) {
  const Pose pose = pose_at(scene, job, frame.value());
  const int height = std::clamp(
      static_cast<int>(std::int64_t{kWidth} * job.image.height / job.image.width), 1, 2 * kWidth);
  PreviewCanvas canvas(camera_at(job, frame.value()), kWidth, height);
  for (const Instance& instance : pose.instances) {
    const std::span<const Vec3> at = vertices_of(scene, pose.shapes, instance.mesh).positions;
    for (const auto& corners : scene.meshes[instance.mesh].triangles) {
      const auto point = [&](std::size_t c) { return instance.to_world.point(at[corners[c]]); };
      canvas.triangle({point(0), point(1), point(2)}, {1, 1, 1});
    }
  }

  // Only the part that is rendered counts.
  const PixelRect part = job.image.rendered();
  int seen = 0, all = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float px =
          (static_cast<float>(x) + 0.5f) * static_cast<float>(job.image.width) / kWidth;
      const float py = (static_cast<float>(y) + 0.5f) * static_cast<float>(job.image.height) /
                       static_cast<float>(height);
      if (px < static_cast<float>(part.x0) || px > static_cast<float>(part.x1) ||
          py < static_cast<float>(part.y0) || py > static_cast<float>(part.y1))
        continue;
      ++all;
      seen += canvas.covers(x, y) || sees_ground(job, pose.camera.ray(px, py)) ? 1 : 0;
    }
  }
  return all > 0 ? static_cast<double>(seen) / all : 1.0;
}

}  // namespace

double surface_share(const JobSpec& job, const Scene& scene) {
  const std::vector<FrameNumber>& frames = job.frames;
  double share = 0;
  for (const FrameNumber frame : std::set{frames.front(), frames[frames.size() / 2], frames.back()})
    share = std::max(share, share_in(job, scene, frame));
  return share;
}

}  // namespace baton
