#include "jobs/cli/check/preview_canvas.h"

#include <algorithm>
#include <cmath>

#include "common/image/pixel_text.h"

namespace baton {
namespace {

constexpr Rgb kEmpty{0.11f, 0.12f, 0.14f};
/// Share of the colour that a surface seen from its edge keeps.
constexpr float kEdgeOn = 0.25f;
/// Points of a line, so that the part of it that is before the eye is drawn.
constexpr int kLineSteps = 512;

}  // namespace

PreviewCanvas::PreviewCanvas(const CameraSpec& camera, int width, int height)
    : camera_(camera, width, height), image_{width, height, {}} {
  eye_ = camera_.ray(0, 0).origin;
  image_.rgb.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  nearness_.resize(image_.rgb.size() / 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) set(x, y, kEmpty);
  }
}

void PreviewCanvas::triangle(const std::array<Vec3, 3>& corners, const Rgb& color) {
  // Where its corners are in the picture.
  std::array<std::array<float, 2>, 3> p;
  std::array<float, 3> nearness;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto place = camera_.project(corners[i]);
    if (!place) return;
    p[i] = *place;
    nearness[i] = 1 / std::max(length(corners[i] - eye_), 1e-9f);
  }
  const float area =
      (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
  if (area == 0 || !std::isfinite(area)) return;

  // Its shade.
  const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const Vec3 view = corners[0] - eye_;
  const float facing =
      std::abs(dot(normal, view)) / std::max(length(normal) * length(view), 1e-30f);
  const Rgb shade = color * (kEdgeOn + (1 - kEdgeOn) * facing);

  // The pixels whose centres it covers, if it is the nearest.
  const auto range = [&](std::size_t axis, int size) {
    const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
    return std::pair(static_cast<int>(std::clamp(low, 0.0f, static_cast<float>(size))),
                     static_cast<int>(std::clamp(high + 1, 0.0f, static_cast<float>(size))));
  };
  const auto [x0, x1] = range(0, image_.width);
  const auto [y0, y1] = range(1, image_.height);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const float at_x = static_cast<float>(x) + 0.5f, at_y = static_cast<float>(y) + 0.5f;
      std::array<float, 3> share;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
        share[i] = ((b[0] - a[0]) * (at_y - a[1]) - (at_x - a[0]) * (b[1] - a[1])) / area;
      }
      if (share[0] < 0 || share[1] < 0 || share[2] < 0) continue;
      const float near = share[0] * nearness[0] + share[1] * nearness[1] + share[2] * nearness[2];
      float& nearest =
          nearness_[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                    static_cast<std::size_t>(x)];
      if (near <= nearest) continue;
      nearest = near;
      set(x, y, shade);
    }
  }
}

void PreviewCanvas::line(const Vec3& from, const Vec3& to, const Rgb& color) {
  for (int i = 0; i <= kLineSteps; ++i) {
    const float t = static_cast<float>(i) / kLineSteps;
    const auto place = camera_.project(from * (1 - t) + to * t);
    if (!place || !(std::abs((*place)[0]) < 1e6f) || !(std::abs((*place)[1]) < 1e6f)) continue;
    set(static_cast<int>(std::floor((*place)[0])), static_cast<int>(std::floor((*place)[1])),
        color);
  }
}

void PreviewCanvas::label(const Vec3& at, std::string_view text) {
  const auto place = camera_.project(at);
  if (!place || !(std::abs((*place)[0]) < 1e6f) || !(std::abs((*place)[1]) < 1e6f)) return;
  draw_text(text, static_cast<int>((*place)[0]) - text_width(text) / 2,
            static_cast<int>((*place)[1]), image_);
}

void PreviewCanvas::set(int x, int y, const Rgb& color) {
  if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return;
  float* const pixel =
      image_.rgb.data() + (std::ptrdiff_t{y} * image_.width + std::ptrdiff_t{x}) * 3;
  pixel[0] = color.x;
  pixel[1] = color.y;
  pixel[2] = color.z;
}

}  // namespace baton
