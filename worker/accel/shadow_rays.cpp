#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "worker/accel/accel.h"

namespace baton {
namespace {

Vec3 magnitude(const Vec3& v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }
Mat3 magnitude(Mat3 m) {
  for (float& entry : m.m) entry = std::fabs(entry);
  return m;
}

Vec3 max(const Vec3& a, const Vec3& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// [Waechter & Binder 2019, listing 6.1]
float lifted(float position, float normal, const Lift& lift) {
  if (std::fabs(position) < kLiftOrigin) return position + lift.near * normal;
  const auto steps = static_cast<std::int32_t>(lift.steps * normal);
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(position) +
                              (position < 0 ? -steps : steps));
}

}  // namespace

Lift lift_of(const Bounds& bounds) {
  if (bounds.empty()) return {};
  constexpr float kShareOfPlace = 1.0f / 16384, kShareOfSize = 1.0f / 1024, kLeastSteps = 16;
  const auto largest = [](const Vec3& v) {
    return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
  };
  const float farthest = std::max(largest(bounds.low), largest(bounds.high));
  const float spacing = std::nextafter(farthest, std::numeric_limits<float>::max()) - farthest;
  const float steps = kShareOfSize * largest(bounds.size()) / spacing;
  const Lift usual;
  return {.near = std::min(usual.near, kShareOfPlace * farthest),
          .steps = std::floor(std::clamp(steps, kLeastSteps, usual.steps))};
}

Vec3 rounding_of_rays(const Instance& instance, const Bounds& bounds) {
  constexpr float kShare = 0x1p-23f;
  if (bounds.empty()) return {};
  const Mat3 from_world = magnitude(instance.normal_to_world.transposed());
  const Vec3 farthest = max(magnitude(bounds.low), magnitude(bounds.high));
  const Vec3 in_mesh = from_world * (farthest + magnitude(instance.to_world.offset));
  return magnitude(instance.to_world.linear) * in_mesh * kShare;
}

Vec3 lift_off(const Vec3& position, const Vec3& extent, const Vec3& ng, const Lift& lift) {
  const Vec3 near{lifted(position.x, ng.x, lift), lifted(position.y, ng.y, lift),
                  lifted(position.z, ng.z, lift)};
  const float least = dot(extent * kPositionError + lift.of_rays, magnitude(ng));
  return near + ng * std::max(least - dot(near - position, ng), 0.0f);
}

Vec3 lift_off(const Vec3& position, const Vec3& ng, const Lift& lift) {
  return lift_off(position, magnitude(position), ng, lift);
}

void ShadowRays::reserve(std::size_t capacity) {
  if (capacity <= t_far.size()) return;
  for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                      &t_near, &t_far}) {
    array->resize(capacity, 0.0f);
  }
}

}  // namespace baton
