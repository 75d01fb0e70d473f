#include "worker/scene/camera.h"

#include <cmath>

namespace baton {
namespace {

/// The unit axis that `v` points along least.
Vec3 least_aligned_axis(const Vec3& v) {
  const float x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z);
  if (x <= y && x <= z) return {1, 0, 0};
  return y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
}

/// The columns give dot products with points seen from `origin`; `last` is added.
Matrix4 from_columns(const Vec3& origin, const std::array<Vec3, 4>& column,
                     const std::array<float, 4>& last) {
  Matrix4 m{};
  for (std::size_t c = 0; c < 4; ++c) {
    m[c] = column[c].x;
    m[4 + c] = column[c].y;
    m[8 + c] = column[c].z;
    m[12 + c] = last[c] - dot(origin, column[c]);
  }
  for (float& value : m) value += 0.0f;  // no -0, which people would wonder about
  return m;
}

}  // namespace

Camera::Camera(const CameraSpec& spec, int width, int height) : origin_(spec.position) {
  // Build a right-handed frame; an up vector along the view is replaced by any other.
  const Vec3 forward = normalize(spec.look_at - spec.position);
  constexpr float kMinSine = 1e-6f;
  Vec3 side = cross(forward, normalize(spec.up));
  if (length(side) < kMinSine) side = cross(forward, least_aligned_axis(forward));
  const Vec3 right = normalize(side);
  const Vec3 up = cross(right, forward);

  // Scale it to pixels on the plane one unit ahead.
  const double half_angle = 0.5 * spec.vertical_fov_deg * 3.14159265358979323846 / 180.0;
  const auto pixel = static_cast<float>(2 * std::tan(half_angle) / height);
  right_ = right * pixel;
  down_ = up * -pixel;
  forward_ = forward;
  center_x_ = 0.5f * static_cast<float>(width);
  center_y_ = 0.5f * static_cast<float>(height);
  corner_ = forward - right_ * (0.5f * static_cast<float>(width)) -
            down_ * (0.5f * static_cast<float>(height));
}

Ray Camera::ray(float x, float y) const {
  return {origin_, normalize(corner_ + right_ * x + down_ * y)};
}

std::optional<std::array<float, 2>> Camera::project(const Vec3& point) const {
  const Vec3 view = point - origin_;
  const float ahead = dot(view, forward_);
  if (!(ahead > 0)) return std::nullopt;
  return std::array<float, 2>{center_x_ + dot(view, right_) / (dot(right_, right_) * ahead),
                              center_y_ + dot(view, down_) / (dot(down_, down_) * ahead)};
}

Matrix4 Camera::world_to_camera() const {
  return from_columns(origin_, {normalize(right_), normalize(down_) * -1, forward_ * -1, Vec3{}},
                      {0, 0, 0, 1});
}

Matrix4 Camera::world_to_ndc(const PixelRect& shown) const {
  // project(), times the distance, from pixels of `shown` to [-1, 1].
  const float x_scale = 2 / static_cast<float>(shown.width());
  const float y_scale = -2 / static_cast<float>(shown.height());
  const float x_center = x_scale * (center_x_ - static_cast<float>(shown.x0)) - 1;
  const float y_center = y_scale * (center_y_ - static_cast<float>(shown.y0)) + 1;
  return from_columns(
      origin_,
      {right_ * (x_scale / dot(right_, right_)) + forward_ * x_center,
       down_ * (y_scale / dot(down_, down_)) + forward_ * y_center, Vec3{}, forward_},
      {0, 0, 1, 0});
}

}  // namespace baton
