#include "common/scene/gltf/matrix.h"

namespace baton::gltf {

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix r{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      r[i * 4 + j] = a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] +
                     (j == 3 ? a[i * 4 + 3] : 0.0);
    }
  }
  return r;
}

Matrix compose(const std::array<double, 3>& t, const Quaternion& q,
               const std::array<double, 3>& s) {
  const auto [x, y, z, w] = q;
  return {(1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y - z * w) * s[1],
          2 * (x * z + y * w) * s[2],       t[0],
          2 * (x * y + z * w) * s[0],       (1 - 2 * (x * x + z * z)) * s[1],
          2 * (y * z - x * w) * s[2],       t[1],
          2 * (x * z - y * w) * s[0],       2 * (y * z + x * w) * s[1],
          (1 - 2 * (x * x + y * y)) * s[2], t[2]};
}

double determinant(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
         m[2] * (m[4] * m[9] - m[5] * m[8]);
}

std::array<float, 12> to_floats(const Matrix& m) {
  std::array<float, 12> floats{};
  for (std::size_t i = 0; i < m.size(); ++i) floats[i] = static_cast<float>(m[i]);
  return floats;
}

Transform to_transform(const Matrix& m) {
  const std::array<float, 12> f = to_floats(m);
  return {{{f[0], f[1], f[2], f[4], f[5], f[6], f[8], f[9], f[10]}}, {f[3], f[7], f[11]}};
}

}  // namespace baton::gltf
