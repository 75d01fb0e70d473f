#include "common/scene/object_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// How far apart floats are at the largest coordinate of a place.
float float_spacing(const Vec3& place) {
  const float largest = std::max({std::fabs(place.x), std::fabs(place.y), std::fabs(place.z)});
  return std::nextafter(largest, std::numeric_limits<float>::max()) - largest;
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

  /// How far apart floats are where a box comes nearest to the eye, in pixels there. An eye within
  /// sees it from a share of its size.
  float spacing_in_pixels(const BoxCorners& box) const {
    constexpr float kNearestShare = 1.0f / 64;
    const Vec3 eye = camera_.plane().eye;
    Bounds bounds;
    for (const Vec3& corner : box) bounds.add(corner);
    const Vec3 nearest{std::clamp(eye.x, bounds.low.x, bounds.high.x),
                       std::clamp(eye.y, bounds.low.y, bounds.high.y),
                       std::clamp(eye.z, bounds.low.z, bounds.high.z)};
    const float distance = std::max(length(nearest - eye), kNearestShare * length(bounds.size()));
    return float_spacing(nearest) / camera_.pixel_width(camera_.plane().forward, distance);
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

/// What the best frame shows of an instance.
struct Shown {
  Sight best = Sight::behind;
  /// View::spacing_in_pixels, the most of the frames that show it, and the place there.
  float spacing_px = 0;
  Vec3 place{};
};

/// Objects whose places floats round to more than a small share of a pixel.
void warn_of_coarse_places(const JobSpec& job, const std::vector<Shown>& shown,
                           std::vector<std::string>& warnings) {
  constexpr float kMostPixels = 0.125f;
  for (std::size_t i = 0; i < std::min(shown.size(), job.scene.objects.size()); ++i) {
    if (!(shown[i].spacing_px > kMostPixels)) continue;
    warnings.push_back(fmt::format(
        "object {} ({}) is so far from the origin, {:.3g} units, that its places are rounded to "
        "{:.2g} units, {:.2g} pixels: bring it and the camera nearer, by `center` or `translate`",
        i, label_of(job.scene.objects[i]), length(shown[i].place), float_spacing(shown[i].place),
        shown[i].spacing_px));
  }
}

}  // namespace

std::vector<std::string> geometry_warnings(const JobSpec& job, const Scene& scene) {
  std::vector<BoxCorners> boxes;
  for (const TriangleMesh& mesh : scene.meshes) boxes.push_back(corners_of(mesh.positions));
  std::vector<Shown> shown(scene.instances.size());
  for (const FrameNumber frame : pick_frames(job.frames, kMostFrames)) {
    const Pose pose = pose_at(scene, job, frame.value());
    const View view(pose.camera, job.image);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const std::uint32_t mesh = pose.instances[i].mesh;
      BoxCorners box = pose.instances[i].deforms
                           ? corners_of(vertices_of(scene, pose.shapes, mesh).positions)
                           : boxes[mesh];
      for (Vec3& corner : box) corner = pose.instances[i].to_world.point(corner);
      const Sight sight = view.sight(box);
      shown[i].best = std::max(shown[i].best, sight);
      const float spacing_px = sight == Sight::seen ? view.spacing_in_pixels(box) : 0;
      if (!(spacing_px > shown[i].spacing_px)) continue;
      shown[i].spacing_px = spacing_px;
      shown[i].place = box[0];
    }
  }

  std::vector<std::string> warnings;
  if (const std::uint64_t dropped = count_dropped(scene); dropped > 0)
    warnings.push_back(fmt::format("{} triangles without area are left out", dropped));
  warn_of_repairs(job, scene, warnings);
  for (const Material& material : scene.materials) {
    if (material.detail != nullptr) append(material.detail->notes, warnings);
  }
  for (std::size_t i = 0; i < std::min(shown.size(), job.scene.objects.size()); ++i) {
    if (shown[i].best != Sight::seen)
      warnings.push_back(fmt::format("object {} ({}) {}", i, label_of(job.scene.objects[i]),
                                     words(shown[i].best)));
  }
  warn_of_coarse_places(job, shown, warnings);
  const bool nothing =
      std::ranges::none_of(shown, [](const Shown& s) { return s.best >= Sight::tiny; });
  if (nothing) warnings.push_back("the camera sees no object and no ground in any frame");
  return warnings;
}

}  // namespace baton
