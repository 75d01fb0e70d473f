#include "common/scene/camera.h"

#include <cmath>

namespace baton {
namespace {

/// The unit axis that `v` points along least.
Vec3 least_aligned_axis(const Vec3& v) {
  const float x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z);
  if (x <= y && x <= z) return {1, 0, 0};
  return y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
}

/// A point of the unit disk; squares become sectors of the same area [Shirley & Chiu 1997].
std::array<float, 2> point_of_disk(const std::array<float, 2>& u) {
  constexpr float kQuarterPi = 0.785398163397448f;
  const float x = 2 * u[0] - 1, y = 2 * u[1] - 1;
  if (x == 0 && y == 0) return {0, 0};
  const bool is_wide = std::fabs(x) > std::fabs(y);
  const float radius = is_wide ? x : y;
  const float angle = kQuarterPi * (is_wide ? y / x : 2 - x / y);
  return {radius * std::cos(angle), radius * std::sin(angle)};
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
  is_orthographic_ = spec.projection == Projection::orthographic;
  const double half_angle = 0.5 * spec.vertical_fov_deg * 3.14159265358979323846 / 180.0;
  const double picture =
      is_orthographic_ ? double{spec.orthographic_height} : 2 * std::tan(half_angle);
  const auto pixel = static_cast<float>(picture / height);
  right_ = right * pixel;
  down_ = up * -pixel;
  forward_ = forward;
  center_x_ = 0.5f * static_cast<float>(width) - spec.shift[0] * static_cast<float>(height);
  center_y_ = 0.5f * static_cast<float>(height) + spec.shift[1] * static_cast<float>(height);
  corner_ = forward - right_ * center_x_ - down_ * center_y_;
  lens_radius_ = 0.5f * spec.aperture;
  focus_distance_ =
      spec.focus_distance > 0 ? spec.focus_distance : length(spec.look_at - spec.position);
}

Ray Camera::ray(float x, float y) const {
  const Vec3 ahead = corner_ + right_ * x + down_ * y;
  if (is_orthographic_) return {origin_ + (ahead - forward_), forward_};
  return {origin_, normalize(ahead)};
}

Ray Camera::ray(float x, float y, const std::array<float, 2>& u) const {
  // Both rays meet on the plane that is sharp.
  const Ray middle = ray(x, y);
  const Vec3 focus =
      middle.origin + middle.direction * (focus_distance_ / dot(middle.direction, forward_));
  const std::array<float, 2> disk = point_of_disk(u);
  const float pixel = length(right_);
  const Vec3 origin = middle.origin + right_ * (lens_radius_ / pixel * disk[0]) +
                      down_ * (lens_radius_ / pixel * disk[1]);
  return {origin, normalize(focus - origin)};
}

std::optional<std::array<float, 2>> Camera::project(const Vec3& point) const {
  const Vec3 view = point - origin_;
  const float ahead = dot(view, forward_);
  if (!(ahead > 0)) return std::nullopt;
  const float depth = is_orthographic_ ? 1 : ahead;
  return std::array<float, 2>{center_x_ + dot(view, right_) / (dot(right_, right_) * depth),
                              center_y_ + dot(view, down_) / (dot(down_, down_) * depth)};
}

std::optional<std::array<float, 2>> Camera::project_direction(const Vec3& direction) const {
  // Parallel rays see one direction everywhere: it has no place.
  if (is_orthographic_) return std::nullopt;
  return project(origin_ + direction);
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
  const Vec3 x_axis = right_ * (x_scale / dot(right_, right_));
  const Vec3 y_axis = down_ * (y_scale / dot(down_, down_));
  if (is_orthographic_)
    return from_columns(origin_, {x_axis, y_axis, forward_, Vec3{}}, {x_center, y_center, 0, 1});
  return from_columns(
      origin_, {x_axis + forward_ * x_center, y_axis + forward_ * y_center, Vec3{}, forward_},
      {0, 0, 1, 0});
}

}  // namespace baton
