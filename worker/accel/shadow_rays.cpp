#include <bit>
#include <cmath>

#include "worker/accel/accel.h"

namespace baton {
namespace {

/// [Waechter & Binder 2019, listing 6.1]
float lift(float position, float normal) {
  if (std::fabs(position) < kLiftOrigin) return position + kLiftNear * normal;
  const auto steps = static_cast<std::int32_t>(kLiftSteps * normal);
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(position) +
                              (position < 0 ? -steps : steps));
}

}  // namespace

Vec3 lift_off(const Vec3& position, const Vec3& ng) {
  return {lift(position.x, ng.x), lift(position.y, ng.y), lift(position.z, ng.z)};
}

void ShadowRays::reserve(std::size_t capacity) {
  if (capacity <= t_far.size()) return;
  for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                      &t_near, &t_far}) {
    array->resize(capacity, 0.0f);
  }
}

}  // namespace baton
