#include "common/scene/material/measured_brdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::size_t kHeaderBytes = 3 * sizeof(std::int32_t);
constexpr std::size_t kFileBytes = kHeaderBytes + 3 * MeasuredBrdf::kEntries * sizeof(double);

/// Half angle of row h, counted in rows: whole numbers are edges.
float theta_h_at(float h) {
  const float root = h / MeasuredBrdf::kThetaH;
  return root * root * (kPi / 2);
}

/// Two neighbours on an axis and the weight of the second.
struct Neighbours {
  int first, second;
  float mix;
};
/// x: position in cells, centres at .5; held at both ends.
Neighbours clamped(float x, int count) {
  const float at = std::clamp(x - 0.5f, 0.0f, static_cast<float>(count - 1));
  const int first = std::min(static_cast<int>(at), count - 2);
  return {first, first + 1, at - static_cast<float>(first)};
}
/// The same on a ring; x in [0, count].
Neighbours wrapped(float x, int count) {
  const float at = x - 0.5f;
  const float floor = std::floor(at);
  const int first = static_cast<int>(floor);
  return {(first + count) % count, (first + 1) % count, at - floor};
}

}  // namespace

Result<std::shared_ptr<const MeasuredBrdf>> MeasuredBrdf::load(const std::string& path) {
  BATON_TRY(expect_file(path));
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxAssetFileBytes));
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, fmt::format("{}: not a MERL table: {}", path, what)};
  };
  if (bytes.size() < kHeaderBytes)
    return fail(fmt::format("{} bytes, expected {}", bytes.size(), kFileBytes));
  std::array<std::int32_t, 3> dimensions{};
  std::memcpy(dimensions.data(), bytes.data(), kHeaderBytes);
  if (dimensions != std::array<std::int32_t, 3>{kThetaH, kThetaD, kPhiD}) {
    return fail(fmt::format("dimensions {} x {} x {}, expected {} x {} x {}", dimensions[0],
                            dimensions[1], dimensions[2], kThetaH, kThetaD, kPhiD));
  }
  if (bytes.size() != kFileBytes)
    return fail(fmt::format("{} bytes, expected {}", bytes.size(), kFileBytes));

  // Channel by channel into texels.
  auto table = std::make_shared<MeasuredBrdf>();
  table->texels_.assign(4 * kEntries, 0.0f);
  bool any_positive = false;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < kEntries; ++i) {
      double value = 0;
      std::memcpy(&value, bytes.data() + kHeaderBytes + (c * kEntries + i) * sizeof(double),
                  sizeof(double));
      const auto f = static_cast<float>(value * kScale[c]);
      if (!(std::isfinite(f) && f > 0)) continue;
      table->texels_[4 * i + c] = f;
      any_positive = true;
    }
  }
  if (!any_positive) return fail("no value is positive");
  return std::shared_ptr<const MeasuredBrdf>(std::move(table));
}

std::shared_ptr<const MeasuredBrdf> MeasuredBrdf::tabulate(const AngleFunction& function) {
  auto table = std::make_shared<MeasuredBrdf>();
  table->texels_.assign(4 * kEntries, 0.0f);
  constexpr float kDegree = kPi / 180;
  for (int h = 0; h < kThetaH; ++h) {
    for (int d = 0; d < kThetaD; ++d) {
      for (int p = 0; p < kPhiD; ++p) {
        const Rgb f = function(theta_h_at(static_cast<float>(h) + 0.5f),
                               (static_cast<float>(d) + 0.5f) * kDegree,
                               (static_cast<float>(p) + 0.5f) * kDegree);
        float* texel = &table->texels_[4 * index(h, d, p)];
        texel[0] = f.x;
        texel[1] = f.y;
        texel[2] = f.z;
      }
    }
  }
  return table;
}

Rgb MeasuredBrdf::evaluate(const Vec3& n, const Vec3& wi, const Vec3& wo) const {
  // The half vector's angle to n, and wi's angles about the half vector: cross products keep small
  // angles exact.
  const Vec3 h = normalize(wi + wo);
  const Vec3 n_cross_h = cross(n, h);
  const float n_h = dot(n, h);
  const float wi_h = dot(wi, h);
  const float theta_h = std::atan2(length(n_cross_h), n_h);
  const float theta_d = std::atan2(length(cross(wi, h)), wi_h);
  float phi_d = std::atan2(dot(wi, n_cross_h), n_h * wi_h - dot(wi, n));
  if (phi_d < 0) phi_d += kPi;

  // Interpolate between the eight neighbours.
  const Neighbours rows = clamped(std::sqrt(theta_h * (2 / kPi)) * kThetaH, kThetaH);
  const Neighbours columns = clamped(theta_d * (2 / kPi) * kThetaD, kThetaD);
  const Neighbours ring = wrapped(phi_d / kPi * kPhiD, kPhiD);
  Rgb sum;
  for (int corner = 0; corner < 8; ++corner) {
    const bool next_h = (corner & 1) != 0;
    const bool next_d = (corner & 2) != 0;
    const bool next_p = (corner & 4) != 0;
    const float weight = (next_h ? rows.mix : 1 - rows.mix) *
                         (next_d ? columns.mix : 1 - columns.mix) *
                         (next_p ? ring.mix : 1 - ring.mix);
    const float* texel = &texels_[4 * index(next_h ? rows.second : rows.first,
                                            next_d ? columns.second : columns.first,
                                            next_p ? ring.second : ring.first)];
    sum += Rgb{texel[0], texel[1], texel[2]} * weight;
  }
  return sum;
}

MeasuredBrdf::FittedLobe MeasuredBrdf::fit_lobe() const {
  // The profile over the half angle where light comes from 20 degrees beside the half vector.
  constexpr int kColumn = 20;
  std::array<float, kThetaH> profile{};
  for (int h = 0; h < kThetaH; ++h) {
    for (int p = 0; p < kPhiD; ++p) {
      const float* texel = &texels_[4 * index(h, kColumn, p)];
      profile[static_cast<std::size_t>(h)] += (texel[0] + texel[1] + texel[2]) / (3 * kPhiD);
    }
  }

  // What the peak adds to its surroundings; rows past 60 degrees may lie below a horizon.
  constexpr int kLastRow = 73;
  const float base = *std::min_element(profile.begin(), profile.begin() + kLastRow);
  const float peak = profile[0] - base;
  if (!(peak > base * 0.01f)) return {};
  float half_row = 0;
  double lobe_albedo = 0;
  for (int h = 0; h < kLastRow; ++h) {
    const float above = profile[static_cast<std::size_t>(h)] - base;
    if (half_row == 0 && above < peak / 2) half_row = static_cast<float>(h);
    const float theta = theta_h_at(static_cast<float>(h) + 0.5f);
    const float width = theta_h_at(static_cast<float>(h) + 1) - theta_h_at(static_cast<float>(h));
    // A cone of half vectors is four times as wide in directions of light.
    lobe_albedo += 4.0 * above * std::cos(theta) * 2 * kPi * std::sin(theta) * width;
  }

  // D(theta) / D(0) of GGX is a half near tan(theta) = alpha sqrt(sqrt(2) - 1).
  const float alpha = std::tan(theta_h_at(half_row)) / 0.6436f;
  const double share = lobe_albedo / (lobe_albedo + kPi * base);
  return {std::clamp(alpha, 0.02f, 1.0f), static_cast<float>(std::min(share, 0.9))};
}

}  // namespace baton
