#pragma once

#include <array>
#include <optional>

#include "common/job/job_spec.h"
#include "common/math/pixel_rect.h"
#include "common/math/vec3.h"

namespace baton {

/// Row by row; points are row vectors, as in OpenEXR.
using Matrix4 = std::array<float, 16>;

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< unit
};

/// Where rays of a camera come from and what they pass, lens aside: position (x, y) of the image is
/// the point corner + x right + y down of the plane one unit ahead, seen from the eye.
struct ImagePlane {
  Vec3 eye;
  Vec3 forward;  ///< unit
  Vec3 right;    ///< step of one pixel
  Vec3 down;
  Vec3 corner;
  bool is_orthographic = false;
};

/// Perspective or orthographic camera with a thin lens. Pixel coordinates: (0, 0) is the upper left
/// corner of the upper left pixel, x to the right, y down.
class Camera {
 public:
  Camera() = default;
  Camera(const CameraSpec& spec, int width, int height);

  /// Ray through image position (x, y) in pixels and the middle of the lens.
  Ray ray(float x, float y) const;
  /// The same through another point of the lens, by u uniform in [0, 1)^2: it meets the other where
  /// the picture is sharp [Cook et al. 1984].
  Ray ray(float x, float y, const std::array<float, 2>& u) const;
  bool has_lens() const { return lens_radius_ > 0; }
  ImagePlane plane() const { return {origin_, forward_, right_, down_, corner_, is_orthographic_}; }
  /// Width of a pixel at `depth` along a unit direction, across the view.
  float pixel_width(const Vec3& direction, float depth) const {
    return length(right_) * (is_orthographic_ ? 1 : depth * dot(direction, forward_));
  }
  /// Image position in pixels of a point that is sharp; the inverse of ray(). nullopt behind the
  /// camera.
  std::optional<std::array<float, 2>> project(const Vec3& point) const;

  /// The same of a point infinitely far away.
  std::optional<std::array<float, 2>> project_direction(const Vec3& direction) const;
  /// Distance of a point from the eye, along the view.
  float distance_ahead(const Vec3& point) const { return dot(point - origin_, forward_); }

  /// Points of the world, as row vectors (x, y, z, 1), to the camera's own frame: x to the right, y
  /// up, looking along -z.
  Matrix4 world_to_camera() const;
  /// To what `shown`, pixels of the whole picture, displays: after division by w, which is the
  /// distance along the view, x and y are in [-1, 1], y up, and z is 1 / w. Of an
  /// orthographic camera w is 1 and z that distance.
  Matrix4 world_to_ndc(const PixelRect& shown) const;

  bool operator==(const Camera&) const = default;

 private:
  Vec3 origin_;
  Vec3 forward_{0, 0, -1};  ///< unit
  /// Step of one pixel on the plane one unit ahead.
  Vec3 right_{1, 0, 0};
  Vec3 down_{0, -1, 0};
  /// Position (0, 0) on the plane one unit ahead, from the eye; not unit.
  Vec3 corner_{0, 0, -1};
  bool is_orthographic_ = false;
  float lens_radius_ = 0, focus_distance_ = 1;
  float center_x_ = 0, center_y_ = 0;  ///< image position straight ahead
};

}  // namespace baton
