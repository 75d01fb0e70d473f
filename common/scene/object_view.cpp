#include "common/scene/object_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "common/job/plan/sequence.h"
#include "common/math/bounds.h"
#include "common/scene/material/surface_detail.h"
#include "common/scene/pose.h"

namespace baton {
namespace {

constexpr std::size_t kMostFrames = 100;

using BoxCorners = std::array<Vec3, 8>;

/// The corners of the box around the points of a mesh.
BoxCorners corners_of(std::span<const Vec3> points) {
  Bounds bounds;
  for (const Vec3& p : points) bounds.add(p);
  BoxCorners corners;
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = bounds.corner(i);
  return corners;
}

/// What a camera's picture has of a box.
enum class Sight { behind, outside, tiny, seen };

/// The planes through the borders of a picture, and the one across it through the eye.
class View {
 public:
  View(const Camera& camera, const ImageSpec& image) : camera_(camera) {
    const auto w = static_cast<float>(image.width), h = static_cast<float>(image.height);
    const Ray ahead = camera.ray(w / 2, h / 2);
    planes_[0] = {ahead.origin, ahead.direction};
    const std::array<Ray, 4> corners{camera.ray(0, 0), camera.ray(w, 0), camera.ray(w, h),
                                     camera.ray(0, h)};
    for (std::size_t i = 0; i < 4; ++i) {
      const Ray &a = corners[i], &b = corners[(i + 1) % 4];
      // Differences first: far away a direction is lost beside a place.
      const Vec3 normal = cross(a.direction, (b.origin - a.origin) + (b.direction - a.direction));
      const bool is_inward = dot(normal, (ahead.origin - a.origin) + ahead.direction) >= 0;
      planes_[i + 1] = {a.origin, is_inward ? normal : normal * -1.0f};
    }
  }

  Sight sight(const BoxCorners& box) const {
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      const bool none_inside = std::ranges::all_of(box, [&](const Vec3& corner) {
        return dot(planes_[i].inward, corner - planes_[i].point) <= 0;
      });
      if (none_inside) return i == 0 ? Sight::behind : Sight::outside;
    }
    return is_tiny(box) ? Sight::tiny : Sight::seen;
  }

 private:
  bool is_tiny(const BoxCorners& box) const {
    std::array<float, 2> low{1e30f, 1e30f}, high{-1e30f, -1e30f};
    for (const Vec3& corner : box) {
      const auto place = camera_.project(corner);
      if (!place) return false;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], (*place)[axis]);
        high[axis] = std::max(high[axis], (*place)[axis]);
      }
    }
    return high[0] - low[0] < 1 && high[1] - low[1] < 1;
  }

  struct Plane {
    Vec3 point, inward;
  };
  const Camera& camera_;
  std::array<Plane, 5> planes_;
};

std::string_view words(Sight best) {
  constexpr std::array<std::string_view, 4> kWords{"is behind the camera in every frame",
                                                   "is outside of the picture in every frame",
                                                   "is smaller than a pixel in every frame", ""};
  return kWords.at(static_cast<std::size_t>(best));
}

}  // namespace

std::uint64_t count_dropped(const Scene& scene) {
  std::uint64_t dropped = 0;
  for (const TriangleMesh& mesh : scene.meshes) dropped += mesh.dropped_triangles;
  return dropped;
}

const std::string& label_of(const ObjectSpec& object) {
  return object.name.empty() ? object.mesh : object.name;
}

namespace {

void append(const std::vector<std::string>& lines, std::vector<std::string>& warnings) {
  warnings.insert(warnings.end(), lines.begin(), lines.end());
}

/// What was made anew or left out of files, summed over the meshes of each.
void warn_of_repairs(const JobSpec& job, const Scene& scene, std::vector<std::string>& warnings) {
  std::map<std::string, MeshRepairs> by_file;
  std::size_t index = 0;  // the scene has the meshes in the order of the job
  for (const auto& [name, spec] : job.scene.meshes) {
    by_file[spec.path] += scene.meshes[index].repairs;
    ++index;
  }
  for (const auto& [file, repairs] : by_file) {
    for (const auto& [count, what] : repair_kinds()) {
      if (repairs.*count > 0)
        warnings.push_back(fmt::format("{}: {} {}", file, repairs.*count, what));
    }
  }
}

}  // namespace

std::vector<std::string> geometry_warnings(const JobSpec& job, const Scene& scene) {
  std::vector<BoxCorners> boxes;
  for (const TriangleMesh& mesh : scene.meshes) boxes.push_back(corners_of(mesh.positions));
  std::vector<Sight> best(scene.instances.size(), Sight::behind);
  for (const FrameNumber frame : pick_frames(job.frames, kMostFrames)) {
    const Pose pose = pose_at(scene, job, frame.value());
    const View view(pose.camera, job.image);
    for (std::size_t i = 0; i < best.size(); ++i) {
      const std::uint32_t mesh = pose.instances[i].mesh;
      BoxCorners box = pose.instances[i].deforms
                           ? corners_of(vertices_of(scene, pose.shapes, mesh).positions)
                           : boxes[mesh];
      for (Vec3& corner : box) corner = pose.instances[i].to_world.point(corner);
      best[i] = std::max(best[i], view.sight(box));
    }
  }

  std::vector<std::string> warnings;
  if (const std::uint64_t dropped = count_dropped(scene); dropped > 0)
    warnings.push_back(fmt::format("{} triangles without area are left out", dropped));
  warn_of_repairs(job, scene, warnings);
  for (const Material& material : scene.materials) {
    if (material.detail != nullptr) append(material.detail->notes, warnings);
  }
  for (std::size_t i = 0; i < std::min(best.size(), job.scene.objects.size()); ++i) {
    if (best[i] != Sight::seen)
      warnings.push_back(
          fmt::format("object {} ({}) {}", i, label_of(job.scene.objects[i]), words(best[i])));
  }
  const bool nothing = std::ranges::none_of(best, [](Sight s) { return s >= Sight::tiny; });
  if (nothing) warnings.push_back("the camera sees no object and no ground in any frame");
  return warnings;
}

}  // namespace baton
