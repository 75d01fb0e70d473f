#include "jobs/cli/check/scene_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/image/contact_sheet.h"
#include "common/job/motion.h"
#include "common/math/bounds.h"
#include "common/scene/object_view.h"
#include "common/scene/pose.h"
#include "jobs/cli/check/preview_canvas.h"

namespace baton {
namespace {

constexpr int kPanelWidth = 640;
constexpr int kMostHeight = 960;
constexpr int kGap = 4;
/// Squares of the ground along a side.
constexpr int kGroundSquares = 40;

constexpr std::array<Rgb, 8> kPalette{Rgb{0.90f, 0.62f, 0.20f}, Rgb{0.35f, 0.70f, 0.90f},
                                      Rgb{0.20f, 0.75f, 0.50f}, Rgb{0.90f, 0.85f, 0.30f},
                                      Rgb{0.85f, 0.40f, 0.30f}, Rgb{0.75f, 0.50f, 0.80f},
                                      Rgb{0.60f, 0.60f, 0.60f}, Rgb{0.45f, 0.55f, 0.95f}};
constexpr Rgb kGround{0.36f, 0.36f, 0.36f}, kGroundDark{0.27f, 0.27f, 0.27f};
constexpr Rgb kBounds{0.75f, 0.75f, 0.75f}, kView{1, 1, 0.6f};

/// The job's first frame.
struct Shot {
  Pose pose;
  CameraSpec camera;
  std::vector<Bounds> objects;  ///< by object of the job; the ground is none
  Bounds all;                   ///< bounds of the objects
};

Shot first_shot(const JobSpec& job, const Scene& scene) {
  const double frame = job.frames.front().value();
  Shot shot{pose_at(scene, job, frame), camera_at(job, frame), {}, {}};
  shot.objects.resize(std::min(job.scene.objects.size(), shot.pose.instances.size()));
  for (std::size_t i = 0; i < shot.objects.size(); ++i) {
    const Instance& instance = shot.pose.instances[i];
    for (const Vec3& p : vertices_of(scene, shot.pose.shapes, instance.mesh).positions)
      shot.objects[i].add(instance.to_world.point(p));
    if (shot.objects[i].empty()) continue;
    shot.all.add(shot.objects[i].low);
    shot.all.add(shot.objects[i].high);
  }
  if (shot.all.empty()) shot.all.add(shot.camera.look_at);
  return shot;
}

/// As squares around the objects, so that what lies behind the eye is left out and size shows.
void draw_ground(const GroundSpec& ground, const Shot& shot, PreviewCanvas& canvas) {
  const Vec3 size = shot.all.size();
  const float half = std::min(ground.size / 2, 4 * std::max({size.x, size.y, size.z, 1e-3f}));
  const Vec3 middle = shot.all.center();
  const float side = 2 * half / kGroundSquares;
  const auto point = [&](int i, int k) {
    const auto inside = [&](float v) { return std::clamp(v, -ground.size / 2, ground.size / 2); };
    return Vec3{inside(middle.x - half + side * static_cast<float>(i)), ground.height,
                inside(middle.z - half + side * static_cast<float>(k))};
  };
  for (int i = 0; i < kGroundSquares; ++i) {
    for (int k = 0; k < kGroundSquares; ++k) {
      const Rgb& color = (i + k) % 2 == 0 ? kGround : kGroundDark;
      canvas.triangle({point(i, k), point(i, k + 1), point(i + 1, k + 1)}, color);
      canvas.triangle({point(i, k), point(i + 1, k + 1), point(i + 1, k)}, color);
    }
  }
}

void draw_box(const Bounds& box, PreviewCanvas& canvas) {
  for (std::size_t i = 0; i < 8; ++i) {
    for (const std::size_t bit : {1, 2, 4}) {
      if ((i & bit) == 0) canvas.line(box.corner(i), box.corner(i | bit), kBounds);
    }
  }
}

void draw_axes(const Shot& shot, PreviewCanvas& canvas) {
  const Vec3 size = shot.all.size();
  const float most = std::max({size.x, size.y, size.z, 1e-6f});
  const float one = std::pow(10.0f, std::floor(std::log10(most)));
  canvas.line({}, {one, 0, 0}, {1, 0.2f, 0.2f});
  canvas.line({}, {0, one, 0}, {0.2f, 1, 0.2f});
  canvas.line({}, {0, 0, one}, {0.3f, 0.4f, 1});
  canvas.label({one, 0, 0}, fmt::format("x {:g}", one));
  canvas.label({0, one, 0}, "y");
  canvas.label({0, 0, one}, "z");
}

void draw_scene(const JobSpec& job, const Scene& scene, const Shot& shot, PreviewCanvas& canvas) {
  if (job.scene.ground) draw_ground(*job.scene.ground, shot, canvas);
  for (std::size_t i = 0; i < shot.objects.size(); ++i) {
    const Instance& instance = shot.pose.instances[i];
    const std::span<const Vec3> at = vertices_of(scene, shot.pose.shapes, instance.mesh).positions;
    for (const auto& corners : scene.meshes[instance.mesh].triangles) {
      const auto point = [&](std::size_t c) { return instance.to_world.point(at[corners[c]]); };
      canvas.triangle({point(0), point(1), point(2)}, kPalette[i % kPalette.size()]);
    }
  }
  for (const Bounds& box : shot.objects) {
    if (!box.empty()) draw_box(box, canvas);
  }
  draw_axes(shot, canvas);
  for (std::size_t i = 0; i < shot.objects.size(); ++i) {
    const Bounds& box = shot.objects[i];
    if (box.empty()) continue;
    const Vec3 top{box.center().x, box.high.y, box.center().z};
    canvas.label(top, fmt::format("{} {}", i, label_of(job.scene.objects[i])));
  }
}

/// From above and aside, far enough for the objects and the camera.
CameraSpec outside(const Shot& shot) {
  constexpr float kFov = 40;
  Bounds whole = shot.all;
  whole.add(shot.camera.position);
  const Vec3 size = whole.size();
  const float radius = std::max(0.5f * length(size), 1e-3f);
  const Vec3 from = normalize(Vec3{0.75f, 0.6f, 1});
  const float distance = 1.15f * radius / std::sin(0.5f * kFov * kPi / 180);
  return {.position = whole.center() + from * distance,
          .look_at = whole.center(),
          .up = {0, 1, 0},
          .vertical_fov_deg = kFov};
}

/// The borders of the camera's picture, as far as the point that it looks at.
void draw_view(const JobSpec& job, const Shot& shot, PreviewCanvas& canvas) {
  const auto w = static_cast<float>(job.image.width), h = static_cast<float>(job.image.height);
  const float reach = std::max(length(shot.camera.look_at - shot.camera.position), 1e-3f);
  const std::array<std::array<float, 2>, 4> corners{{{0, 0}, {w, 0}, {w, h}, {0, h}}};
  std::array<Vec3, 4> ends;
  for (std::size_t i = 0; i < 4; ++i) {
    const Ray ray = shot.pose.camera.ray(corners[i][0], corners[i][1]);
    ends[i] = ray.origin + ray.direction * reach;
    canvas.line(ray.origin, ends[i], kView);
  }
  for (std::size_t i = 0; i < 4; ++i) canvas.line(ends[i], ends[(i + 1) % 4], kView);
  canvas.label(shot.camera.position, "camera");
}

}  // namespace

RgbImage scene_preview(const JobSpec& job, const Scene& scene) {
  const Shot shot = first_shot(job, scene);
  const double aspect = static_cast<double>(job.image.height) / job.image.width;
  const int height = std::clamp(static_cast<int>(kPanelWidth * aspect), 1, kMostHeight);
  const int width = std::clamp(static_cast<int>(height / aspect), 1, kPanelWidth);
  PreviewCanvas seen(shot.camera, width, height);
  draw_scene(job, scene, shot, seen);
  PreviewCanvas around(outside(shot), kPanelWidth, std::max(height, kPanelWidth / 2));
  draw_scene(job, scene, shot, around);
  draw_view(job, shot, around);

  RgbImage picture{width + kGap + kPanelWidth, around.image().height, {}};
  picture.rgb.resize(static_cast<std::size_t>(picture.width) *
                     static_cast<std::size_t>(picture.height) * 3);
  const auto add = [&](const RgbImage& panel, int left) {
    paste(panel, {0, 0, panel.width, panel.height}, 1, left, 0, picture);
  };
  add(seen.image(), 0);
  add(around.image(), width + kGap);
  return picture;
}

std::vector<std::string> object_lines(const JobSpec& job, const Scene& scene) {
  const Shot shot = first_shot(job, scene);
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < shot.objects.size(); ++i) {
    const Bounds& box = shot.objects[i];
    const ObjectSpec& object = job.scene.objects[i];
    if (box.empty()) {
      lines.push_back(fmt::format("{} {} ({}): empty", i, label_of(object), object.material));
      continue;
    }
    const Vec3 size = box.size();
    lines.push_back(
        fmt::format("{} {} ({}): {:.3g} x {:.3g} x {:.3g}, x {:.3g} to {:.3g}, y {:.3g} to {:.3g}, "
                    "z {:.3g} to {:.3g}",
                    i, label_of(object), object.material, size.x, size.y, size.z, box.low.x,
                    box.high.x, box.low.y, box.high.y, box.low.z, box.high.z));
  }
  return lines;
}

}  // namespace baton
