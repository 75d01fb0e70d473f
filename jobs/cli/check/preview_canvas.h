#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "common/image/image_io.h"
#include "common/scene/camera.h"

namespace baton {

/// A picture with a depth for each pixel, drawn triangle by triangle: for looks at a scene that
/// need neither light nor a ray tracer. Colours are display colours in [0, 1].
class PreviewCanvas {
 public:
  PreviewCanvas(const CameraSpec& camera, int width, int height);

  /// Flat, lit from the eye, the same from both sides. Triangles that reach behind the eye are left
  /// out.
  void triangle(const std::array<Vec3, 3>& corners, const Rgb& color);
  /// On top of everything. What lies behind the eye is left out.
  void line(const Vec3& from, const Vec3& to, const Rgb& color);
  /// A small black box with letters, centred above a point; nothing behind the eye.
  void label(const Vec3& at, std::string_view text);

  /// Whether a triangle covers the middle of a pixel.
  bool covers(int x, int y) const {
    return nearness_[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                     static_cast<std::size_t>(x)] > 0;
  }
  const RgbImage& image() const { return image_; }
  RgbImage& image() { return image_; }

 private:
  void set(int x, int y, const Rgb& color);

  Camera camera_;
  Vec3 eye_;
  RgbImage image_;
  /// 1 / distance from the eye; 0: nothing there.
  std::vector<float> nearness_;
};

}  // namespace baton
