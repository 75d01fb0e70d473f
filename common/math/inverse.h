#pragma once

#include <cmath>
#include <optional>

#include "common/math/vec3.h"

namespace baton {

/// Inverse transpose of `m` (cofactors over determinant), in double precision inside; nullopt when
/// `m` is singular or not finite. It maps normals where `m` maps points.
inline std::optional<Mat3> inverse_transposed(const Mat3& m) {
  const auto& a = m.m;
  const auto minor = [&a](int i, int j, int k, int l) {
    return double{a[i]} * a[j] - double{a[k]} * a[l];
  };
  const std::array<double, 9> cofactors{minor(4, 8, 5, 7), minor(5, 6, 3, 8), minor(3, 7, 4, 6),
                                        minor(2, 7, 1, 8), minor(0, 8, 2, 6), minor(1, 6, 0, 7),
                                        minor(1, 5, 2, 4), minor(2, 3, 0, 5), minor(0, 4, 1, 3)};
  const double determinant = a[0] * cofactors[0] + a[1] * cofactors[1] + a[2] * cofactors[2];
  Mat3 result;
  for (std::size_t i = 0; i < 9; ++i) {
    result.m[i] = static_cast<float>(cofactors[i] / determinant);
    if (!std::isfinite(result.m[i])) return std::nullopt;
  }
  return result;
}

}  // namespace baton
