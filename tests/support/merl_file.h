#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "common/scene/material/measured_brdf.h"

namespace baton::test {

/// Writes a BRDF in the MERL binary format, tabulated at the cells' centres. `dimensions` and
/// `drop_bytes` make wrong files.
inline void write_merl(const std::filesystem::path& path,
                       const MeasuredBrdf::AngleFunction& function,
                       std::array<std::int32_t, 3> dimensions = {90, 90, 180},
                       std::size_t drop_bytes = 0) {
  const auto table = MeasuredBrdf::tabulate(function);
  std::vector<double> values;
  values.reserve(3 * MeasuredBrdf::kEntries);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < MeasuredBrdf::kEntries; ++i) {
      values.push_back(double{table->texels()[4 * i + c]} / MeasuredBrdf::kScale[c]);
    }
  }
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(dimensions.data()), sizeof(dimensions));
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(double) - drop_bytes));
}

/// The normalised Phong BRDF of material.h by the angles of a MERL table. Light and view lie at
/// theta_d on either side of the half vector, which is tilted by theta_h.
inline MeasuredBrdf::AngleFunction phong_by_angles(Rgb kd, Rgb ks, float exponent) {
  return [=](float theta_h, float theta_d, float phi_d) {
    // z along the half vector, the normal tilted away from it towards -x.
    const Vec3 n{-std::sin(theta_h), 0, std::cos(theta_h)};
    const Vec3 wi{std::sin(theta_d) * std::cos(phi_d), std::sin(theta_d) * std::sin(phi_d),
                  std::cos(theta_d)};
    const Vec3 wo{-wi.x, -wi.y, wi.z};
    const float cosine = std::max(dot(reflect(wo, n), wi), 0.0f);
    return kd * kInvPi + ks * ((exponent + 2) / (2 * kPi) * std::pow(cosine, exponent));
  };
}

}  // namespace baton::test
