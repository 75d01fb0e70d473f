#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/vec3.h"

namespace baton {

/// A measured isotropic BRDF in the form of the MERL database [Matusik et al. 2003]: RGB over the
/// half angle, its square root evenly divided, and the difference angles [Rusinkiewicz 1998]. Entry
/// (h, d, p) holds the value at the centres
///   theta_h = ((h + .5) / 90)^2 90 degrees, theta_d = d + .5 degrees, phi_d = p + .5 degrees;
/// between them it is interpolated linearly in (h, d, p). phi_d and phi_d + 180 degrees are the
/// same by reciprocity. Negative and non-finite entries (where nothing was measured) are 0.
/// Immutable, 23 MB.
class MeasuredBrdf {
 public:
  static constexpr int kThetaH = 90;
  static constexpr int kThetaD = 90;
  static constexpr int kPhiD = 180;
  static constexpr std::size_t kEntries = std::size_t{kThetaH} * kThetaD * kPhiD;
  /// What the file's numbers are multiplied with, by channel.
  static constexpr std::array<double, 3> kScale{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};

  /// A value by the angles in radians, 1/sr.
  using AngleFunction = std::function<Rgb(float theta_h, float theta_d, float phi_d)>;

  /// Reads a .binary file: three int32 dimensions 90, 90, 180, then all values as double, channel
  /// by channel, theta_h slowest. Errors name the file: missing, other dimensions, another size, no
  /// positive value.
  static Result<std::shared_ptr<const MeasuredBrdf>> load(const std::string& path);
  /// Tabulates a function at the centres.
  static std::shared_ptr<const MeasuredBrdf> tabulate(const AngleFunction& function);

  /// f(wi, wo) in 1/sr; n, wi, wo unit, both above the horizon of n.
  Rgb evaluate(const Vec3& n, const Vec3& wi, const Vec3& wo) const;

  /// (kEntries, 4): R, G, B and a pad, theta_h slowest, phi_d fastest.
  const float* texels() const { return texels_.data(); }

  /// A GGX lobe that resembles the peak, to draw candidates from: its alpha, and the share of the
  /// reflected light that it stands for, [0, 0.9]. The rest is drawn from the cosine lobe, so every
  /// direction above the horizon has density.
  struct FittedLobe {
    float alpha = 1;
    float share = 0;
  };
  FittedLobe fit_lobe() const;

  /// Entry of (h, d, p).
  static std::size_t index(int h, int d, int p) {
    return (static_cast<std::size_t>(h) * kThetaD + static_cast<std::size_t>(d)) * kPhiD +
           static_cast<std::size_t>(p);
  }

 private:
  std::vector<float> texels_;
};

}  // namespace baton
