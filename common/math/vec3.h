#pragma once

#include <array>
#include <cmath>

namespace baton {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;

/// Three floats: a point, a direction (unit where said so) or a linear RGB colour.
struct Vec3 {
  float x = 0, y = 0, z = 0;

  constexpr bool operator==(const Vec3&) const = default;
  constexpr Vec3 operator+(const Vec3& b) const { return {x + b.x, y + b.y, z + b.z}; }
  constexpr Vec3 operator-(const Vec3& b) const { return {x - b.x, y - b.y, z - b.z}; }
  constexpr Vec3 operator*(const Vec3& b) const { return {x * b.x, y * b.y, z * b.z}; }
  constexpr Vec3 operator*(float s) const { return {x * s, y * s, z * s}; }
  constexpr Vec3 operator/(float s) const { return {x / s, y / s, z / s}; }
  constexpr Vec3 operator-() const { return {-x, -y, -z}; }
  constexpr Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
  constexpr Vec3& operator*=(float s) { return *this = *this * s; }
};
constexpr Vec3 operator*(float s, const Vec3& v) { return v * s; }

/// Linear RGB.
using Rgb = Vec3;

constexpr float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(const Vec3& v) { return std::sqrt(dot(v, v)); }
/// v / |v|; the zero vector gives {0, 0, 1}: no NaN leaves this function.
inline Vec3 normalize(const Vec3& v) {
  const float len = length(v);
  return len > 0 && std::isfinite(len) ? v / len : Vec3{0, 0, 1};
}
/// Mirror direction of unit `w` about unit `n`; both point away from the surface.
constexpr Vec3 reflect(const Vec3& w, const Vec3& n) { return n * (2 * dot(n, w)) - w; }
/// Luminance of linear Rec. 709.
constexpr float luminance(const Rgb& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
/// Mean over R, G, B: the scalar that targets are made of.
constexpr float mean(const Rgb& c) { return (c.x + c.y + c.z) * (1.0f / 3.0f); }

/// Right-handed orthonormal frame around unit z [Duff et al. 2017].
struct Frame {
  Vec3 x, y, z;
  explicit Frame(const Vec3& n) : z(n) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    x = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    y = {b, sign + n.y * n.y * a, -n.y};
  }
  Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3 to_local(const Vec3& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

/// Row-major 3x3 matrix.
struct Mat3 {
  std::array<float, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};

  constexpr bool operator==(const Mat3&) const = default;
  constexpr Vec3 operator*(const Vec3& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
  constexpr Mat3 operator*(const Mat3& b) const {
    Mat3 r;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        r.m[i * 3 + j] = m[i * 3] * b.m[j] + m[i * 3 + 1] * b.m[3 + j] + m[i * 3 + 2] * b.m[6 + j];
      }
    }
    return r;
  }
  constexpr Mat3 transposed() const {
    return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}};
  }
};

/// Rotation by `degrees` about `axis` (need not be unit), right-handed.
inline Mat3 rotation_about(const Vec3& axis, double degrees) {
  const Vec3 a = normalize(axis);
  const double radians = degrees * 3.14159265358979323846 / 180.0;
  const auto c = static_cast<float>(std::cos(radians));
  const auto s = static_cast<float>(std::sin(radians));
  const float k = 1 - c;
  return {{c + a.x * a.x * k, a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s,  //
           a.y * a.x * k + a.z * s, c + a.y * a.y * k, a.y * a.z * k - a.x * s,  //
           a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k}};
}

/// Affine map p -> linear * p + offset.
struct Transform {
  Mat3 linear;
  Vec3 offset;

  constexpr bool operator==(const Transform&) const = default;
  constexpr Vec3 point(const Vec3& p) const { return linear * p + offset; }
};

}  // namespace baton
