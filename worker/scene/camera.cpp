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

}  // namespace baton
