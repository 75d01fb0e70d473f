#pragma once

#include <array>
#include <cmath>

#include "common/math/vec3.h"

namespace baton {

/// A rotation as a unit quaternion.
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};

/// x, y, z, w scaled to unit length; the zero quaternion gives the identity.
inline Quaternion to_quaternion(const std::array<float, 4>& q) {
  const double norm = std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] +
                                double{q[3]} * q[3]);
  return norm > 0 ? Quaternion{q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm} : Quaternion{};
}

/// From a to b, the short way round, at constant speed [Shoemake 1985]; t in [0, 1].
inline Quaternion slerp(const Quaternion& a, const Quaternion& b, double t) {
  const double cosine = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
  const double sign = cosine < 0 ? -1 : 1;
  const double angle = std::acos(std::fmin(std::fabs(cosine), 1.0));
  // Close together, the straight line is as good and divides by nothing small.
  const bool straight = angle < 1e-6;
  const double u = straight ? 1 - t : std::sin((1 - t) * angle) / std::sin(angle);
  const double v = sign * (straight ? t : std::sin(t * angle) / std::sin(angle));
  return {u * a.x + v * b.x, u * a.y + v * b.y, u * a.z + v * b.z, u * a.w + v * b.w};
}

inline Mat3 to_matrix(const Quaternion& q) {
  const auto f = [](double x) { return static_cast<float>(x); };
  return {{f(1 - 2 * (q.y * q.y + q.z * q.z)), f(2 * (q.x * q.y - q.z * q.w)),
           f(2 * (q.x * q.z + q.y * q.w)), f(2 * (q.x * q.y + q.z * q.w)),
           f(1 - 2 * (q.x * q.x + q.z * q.z)), f(2 * (q.y * q.z - q.x * q.w)),
           f(2 * (q.x * q.z - q.y * q.w)), f(2 * (q.y * q.z + q.x * q.w)),
           f(1 - 2 * (q.x * q.x + q.y * q.y))}};
}

}  // namespace baton
