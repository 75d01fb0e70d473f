#include "common/scene/settle/settle_motion.h"

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"
#include "common/job/motion.h"
#include "common/scene/pose.h"
#include "common/scene/settle/gltf_motion.h"
#include "common/scene/settle/settle_scene.h"

namespace baton {
namespace {

/// Vertices that are looked at of each instance, spread evenly over the list of its mesh; fewer
/// where there are many instances.
constexpr std::size_t kMeshPoints = 2000, kLeastMeshPoints = 50, kScenePoints = 200000;
/// Vertices over all frames, about two seconds: up to so many motion is measured in all of a shot.
constexpr std::size_t kAllPoints = 50000000;
/// Rays to the ground along each side of the image.
constexpr int kGroundRays = 24;

/// The largest step of any visible point between two frames, in pixels along either axis.
class StepMeter {
 public:
  StepMeter(const Camera& now, const Camera& before, const PixelRect& image)
      : now_(now), before_(before), image_(image) {}

  /// A point that is at `now` in this frame and was at `before`. What leaves the image has no
  /// history anyway.
  void add(const Vec3& now, const Vec3& before) {
    const auto to = now_.project(now);
    const auto from = before_.project(before);
    if (!to || !from || !inside(*to) || !inside(*from)) return;
    largest_ =
        std::max({largest_, std::fabs((*to)[0] - (*from)[0]), std::fabs((*to)[1] - (*from)[1])});
  }
  float largest() const { return largest_; }

 private:
  bool inside(const std::array<float, 2>& p) const {
    return p[0] >= static_cast<float>(image_.x0) && p[1] >= static_cast<float>(image_.y0) &&
           p[0] < static_cast<float>(image_.x1) && p[1] < static_cast<float>(image_.y1);
  }

  const Camera& now_;
  const Camera& before_;
  PixelRect image_;
  float largest_ = 0;
};

/// points: of the scene that are looked at.
void add_meshes(const Scene& scene, const Pose& now, const Pose& before, std::size_t points,
                StepMeter& meter) {
  const std::size_t share = points / std::max<std::size_t>(now.instances.size(), 1);
  const std::size_t most = std::clamp(share, kLeastMeshPoints, kMeshPoints);
  for (std::size_t i = 0; i < now.instances.size(); ++i) {
    if (now.instances[i].is_absent || before.instances[i].is_absent) continue;
    const std::uint32_t mesh = now.instances[i].mesh;
    const std::span<const Vec3> seen = vertices_of(scene, now.shapes, mesh).positions;
    const std::span<const Vec3> old = vertices_of(scene, before.shapes, mesh).positions;
    const std::size_t stride = std::max<std::size_t>(seen.size() / most, 1);
    for (std::size_t k = 0; k < seen.size(); k += stride)
      meter.add(now.instances[i].to_world.point(seen[k]),
                before.instances[i].to_world.point(old[k]));
  }
}

/// The ground has corners only: look where a grid of rays hits it.
void add_ground(const JobSpec& job, const Camera& camera, StepMeter& meter) {
  const PixelRect image = job.image.rendered();
  for (int i = 0; i < kGroundRays * kGroundRays; ++i) {
    const float x = (static_cast<float>(i % kGroundRays) + 0.5f) / kGroundRays;
    const float y = (static_cast<float>(i / kGroundRays) + 0.5f) / kGroundRays;
    const Ray ray =
        camera.ray(static_cast<float>(image.x0) + x * static_cast<float>(image.width()),
                   static_cast<float>(image.y0) + y * static_cast<float>(image.height()));
    const float t = (job.scene.ground->height - ray.origin.y) / ray.direction.y;
    const Vec3 point = ray.origin + ray.direction * t;
    const float half = 0.5f * job.scene.ground->size;
    if (t > 0 && std::fabs(point.x) <= half && std::fabs(point.z) <= half) meter.add(point, point);
  }
}

/// The frames between which motion is measured: from the first key to the last, those of the
/// animations of meshes included, in the job's step, so that all jobs of a shot measure the same.
/// Where that is too much, the job's frames.
std::vector<FrameNumber> measured_frames(const JobSpec& job, const Scene& scene) {
  std::vector<double> keys;
  const auto add = [&](const auto& list) {
    for (const auto& key : list) keys.push_back(key.frame);
  };
  add(job.camera.keys);
  for (const ObjectSpec& object : job.scene.objects) add(object.keys);
  auto points = static_cast<double>(kLeastMeshPoints * scene.instances.size());
  for (const TriangleMesh& mesh : scene.meshes) {
    if (mesh.deformation == nullptr) continue;
    const std::array<double, 2> moving = mesh.deformation->moving_frames();
    keys.insert(keys.end(), moving.begin(), moving.end());
    points += static_cast<double>(mesh.positions.size());
  }
  const auto [first, last] = std::minmax_element(keys.begin(), keys.end());
  if (first == keys.end()) return job.frames;
  int step = 1;
  if (job.frames.size() > 1) {
    step = job.frames[1] - job.frames[0];
    for (std::size_t i = 2; i < job.frames.size(); ++i)
      step = std::min(step, job.frames[i] - job.frames[i - 1]);
  }
  const double steps = (*last - *first) / step;
  if (steps > limits::kMaxFrames || steps * points > static_cast<double>(kAllPoints))
    return job.frames;
  std::vector<FrameNumber> frames;
  for (int frame = static_cast<int>(std::floor(*first)); frame < *last + step; frame += step)
    frames.emplace_back(frame);
  return frames;
}

/// An estimate is enough: a pixel that moved farther starts afresh.
int measure_max_px(const JobSpec& job, const Scene& scene) {
  float largest = 0;
  const std::vector<FrameNumber> frames = measured_frames(job, scene);
  const std::size_t points = std::min(kScenePoints, kAllPoints / frames.size());
  Pose before = pose_at(scene, job, frames.front().value());
  for (const FrameNumber frame : frames) {
    Pose now = pose_at(scene, job, frame.value());
    StepMeter meter(now.camera, before.camera, job.image.rendered());
    add_meshes(scene, now, before, points, meter);
    if (job.scene.ground) add_ground(job, now.camera, meter);
    largest = std::max(largest, meter.largest());
    before = std::move(now);
  }
  // A tenth more for the points between those that were looked at, and one for the rounding to
  // whole pixels.
  return std::min(static_cast<int>(std::ceil(1.1f * largest)) + 1,
                  std::max(job.image.width, job.image.height));
}

}  // namespace

Result<JobSpec> settle_motion(JobSpec job, std::vector<std::string>* left_out) {
  std::vector<std::string> unsaid;
  std::vector<std::string>& said = left_out == nullptr ? unsaid : *left_out;
  BATON_TRY(settle_scene(job, &said));
  if (job.camera.gltf) BATON_TRY(take_camera_keys(job.frames, job.camera, said));
  for (ObjectSpec& object : job.scene.objects) {
    if (object.gltf) BATON_TRY(take_object_keys(job.frames, object, said));
  }
  if (!is_settled(job)) {
    BATON_ASSIGN(const Scene scene, load_scene(job));
    job.motion.max_px = measure_max_px(job, scene);
  }
  return job;
}

}  // namespace baton
