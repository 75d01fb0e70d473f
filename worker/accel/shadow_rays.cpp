#include <bit>
#include <cmath>
#include <limits>

#include "worker/accel/accel.h"

namespace baton {
namespace {

/// Below kOrigin the offset is absolute, above it a number of float steps [Waechter & Binder 2019,
/// listing 6.1].
constexpr float kOrigin = 1.0f / 32.0f;
constexpr float kFloatScale = 1.0f / 65536.0f;
constexpr float kIntScale = 256.0f;

float lift(float position, float normal) {
  if (std::fabs(position) < kOrigin) return position + kFloatScale * normal;
  const auto steps = static_cast<std::int32_t>(kIntScale * normal);
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(position) +
                              (position < 0 ? -steps : steps));
}

}  // namespace

Vec3 lift_off(const Vec3& position, const Vec3& ng) {
  return {lift(position.x, ng.x), lift(position.y, ng.y), lift(position.z, ng.z)};
}

void ShadowRays::clear() {
  for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                      &t_near, &t_far}) {
    array->clear();
  }
}

void ShadowRays::reserve(std::size_t count) {
  for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                      &t_near, &t_far}) {
    array->reserve(count);
  }
}

void ShadowRays::push(const Vec3& origin, const Vec3& direction) {
  origin_x.push_back(origin.x);
  origin_y.push_back(origin.y);
  origin_z.push_back(origin.z);
  direction_x.push_back(direction.x);
  direction_y.push_back(direction.y);
  direction_z.push_back(direction.z);
  t_near.push_back(0.0f);
  t_far.push_back(std::numeric_limits<float>::infinity());
}

}  // namespace baton
