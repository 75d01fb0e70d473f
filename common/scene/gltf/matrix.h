#pragma once

#include <array>

#include "common/math/quaternion.h"
#include "common/scene/gltf/document.h"

/// Arithmetic of node transforms, in double precision.
namespace baton::gltf {

inline constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// a after b.
Matrix multiply(const Matrix& a, const Matrix& b);
/// Scaled, turned by a unit quaternion, moved.
Matrix compose(const std::array<double, 3>& translation, const Quaternion& rotation,
               const std::array<double, 3>& scale);
double determinant(const Matrix& m);
Transform to_transform(const Matrix& m);
std::array<float, 12> to_floats(const Matrix& m);

}  // namespace baton::gltf
