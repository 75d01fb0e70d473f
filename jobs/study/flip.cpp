#include "jobs/study/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/base/check.h"

namespace baton {
namespace {

using Colour = std::array<double, 3>;
/// One channel, (height, width).
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;

  Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * h) {}
  double& at(int x, int y) { return values[static_cast<std::size_t>(y) * width + x]; }
  double at(int x, int y) const { return values[static_cast<std::size_t>(y) * width + x]; }
};
/// Weights at -radius..radius.
using Kernel = std::vector<double>;

/// The paper's constants (section 4).
constexpr double kColourExponent = 0.7;    // q_c
constexpr double kColourKnee = 0.4;        // p_c
constexpr double kColourKneeValue = 0.95;  // p_t
constexpr double kFeatureWidth = 0.082;    // w, degrees
constexpr double kFeatureExponent = 0.5;   // q_f
/// Contrast sensitivity of the opponent channels as sums of two Gaussians: a_1, b_1, a_2, b_2.
constexpr std::array<std::array<double, 4>, 3> kSensitivity{
    {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}}};
constexpr double kWidestGaussian = 0.04;
/// D65.
constexpr Colour kWhite{0.950428545, 1.0, 1.088900371};

// ---- colour spaces ------------------------------------------------------------------------------

Colour xyz_of(const Colour& c) {
  return {0.4124564 * c[0] + 0.3575761 * c[1] + 0.1804375 * c[2],
          0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2],
          0.0193339 * c[0] + 0.1191920 * c[1] + 0.9503041 * c[2]};
}
Colour rgb_of(const Colour& c) {
  return {3.2404542 * c[0] - 1.5371385 * c[1] - 0.4985314 * c[2],
          -0.9692660 * c[0] + 1.8760108 * c[1] + 0.0415560 * c[2],
          0.0556434 * c[0] - 0.2040259 * c[1] + 1.0572252 * c[2]};
}
/// The linear opponent space YCxCz.
Colour opponent_of(const Colour& rgb) {
  const Colour xyz = xyz_of(rgb);
  const double x = xyz[0] / kWhite[0], y = xyz[1] / kWhite[1], z = xyz[2] / kWhite[2];
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}
Colour rgb_of_opponent(const Colour& c) {
  const double y = (c[0] + 16) / 116, x = y + c[1] / 500, z = y - c[2] / 200;
  return rgb_of({x * kWhite[0], y * kWhite[1], z * kWhite[2]});
}
/// CIELab whose a and b fade with darkness (Hunt effect).
Colour hunt_lab_of(const Colour& rgb) {
  const auto root = [](double t) {
    constexpr double kDelta = 6.0 / 29;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
  };
  const Colour xyz = xyz_of(rgb);
  const double x = root(xyz[0] / kWhite[0]), y = root(xyz[1] / kWhite[1]),
               z = root(xyz[2] / kWhite[2]);
  const double lightness = 116 * y - 16;
  return {lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)};
}
/// The HyAB distance, compressed.
double colour_distance(const Colour& a, const Colour& b) {
  const double hyab = std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
  return std::pow(hyab, kColourExponent);
}

// ---- filters ------------------------------------------------------------------------------------

/// Rows with `across`, then columns with `down`; both of one length.
Plane filter(const Plane& in, const Kernel& across, const Kernel& down) {
  const int radius = static_cast<int>(across.size() / 2);
  Plane rows(in.width, in.height), out(in.width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      for (int k = -radius; k <= radius; ++k)
        rows.at(x, y) += across[k + radius] * in.at(std::clamp(x + k, 0, in.width - 1), y);
    }
  }
  for (int y = 0; y < in.height; ++y) {
    for (int k = -radius; k <= radius; ++k) {
      const int from = std::clamp(y + k, 0, in.height - 1);
      for (int x = 0; x < in.width; ++x) out.at(x, y) += down[k + radius] * rows.at(x, from);
    }
  }
  return out;
}

/// A channel as the eye resolves it.
Plane blur(const Plane& in, const std::array<double, 4>& s, double pixels_per_degree) {
  const double pi = std::numbers::pi;
  const int radius = static_cast<int>(
      std::ceil(3 * std::sqrt(kWidestGaussian / (2 * pi * pi)) * pixels_per_degree));
  Plane out(in.width, in.height);
  std::array<Kernel, 2> kernels;
  std::array<double, 2> share{};
  for (int g = 0; g < 2; ++g) {
    const double a = s[2 * g], b = s[2 * g + 1];
    double sum = 0;
    for (int k = -radius; k <= radius; ++k) {
      const double z = k / pixels_per_degree;
      kernels[g].push_back(std::exp(-pi * pi * z * z / b));
      sum += kernels[g].back();
    }
    for (double& weight : kernels[g]) weight /= sum;
    share[g] = a * std::sqrt(pi / b) * sum * sum;
  }
  for (int g = 0; g < 2; ++g) {
    if (share[g] == 0) continue;
    const Plane part = filter(in, kernels[g], kernels[g]);
    for (std::size_t i = 0; i < out.values.size(); ++i)
      out.values[i] += part.values[i] * share[g] / (share[0] + share[1]);
  }
  return out;
}

/// Positive weights to sum 1, negative ones to -1.
void normalize_signed(Kernel& kernel) {
  double positive = 0, negative = 0;
  for (const double weight : kernel) (weight > 0 ? positive : negative) += weight;
  for (double& weight : kernel) weight /= weight > 0 ? positive : -negative;
}

/// Length of the gradient and of the second derivatives, for edges and points.
std::array<Plane, 2> features(const Plane& lightness, double pixels_per_degree) {
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  Kernel smooth, edge, point;
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) {
    const double g = std::exp(-k * k / (2 * sigma * sigma));
    smooth.push_back(g);
    edge.push_back(-k * g);
    point.push_back((k * k / (sigma * sigma) - 1) * g);
    sum += g;
  }
  for (double& weight : smooth) weight /= sum;
  normalize_signed(edge);
  normalize_signed(point);

  const auto length_of = [&](const Kernel& derivative) {
    Plane x = filter(lightness, derivative, smooth);
    const Plane y = filter(lightness, smooth, derivative);
    for (std::size_t i = 0; i < x.values.size(); ++i)
      x.values[i] = std::hypot(x.values[i], y.values[i]);
    return x;
  };
  return {length_of(edge), length_of(point)};
}

/// An image as the measure compares it.
struct Seen {
  std::vector<Colour> colour;  ///< Hunt-adjusted Lab of the blurred image
  std::array<Plane, 2> feature;
};

Seen look_at(const RgbImage& image, double pixels_per_degree) {
  std::array<Plane, 3> opponent{Plane(image.width, image.height), Plane(image.width, image.height),
                                Plane(image.width, image.height)};
  Plane lightness(image.width, image.height);
  for (std::size_t i = 0; i < lightness.values.size(); ++i) {
    const Colour c = opponent_of({image.rgb[3 * i], image.rgb[3 * i + 1], image.rgb[3 * i + 2]});
    for (int k = 0; k < 3; ++k) opponent[k].values[i] = c[k];
    lightness.values[i] = (c[0] + 16) / 116;
  }
  for (int k = 0; k < 3; ++k) opponent[k] = blur(opponent[k], kSensitivity[k], pixels_per_degree);

  Seen seen{{}, features(lightness, pixels_per_degree)};
  for (std::size_t i = 0; i < lightness.values.size(); ++i) {
    Colour rgb =
        rgb_of_opponent({opponent[0].values[i], opponent[1].values[i], opponent[2].values[i]});
    for (double& channel : rgb) channel = std::clamp(channel, 0.0, 1.0);
    seen.colour.push_back(hunt_lab_of(rgb));
  }
  return seen;
}

}  // namespace

std::vector<float> flip_difference(const RgbImage& reference, const RgbImage& test,
                                   double pixels_per_degree) {
  BATON_CHECK(reference.width == test.width && reference.height == test.height);
  const Seen a = look_at(reference, pixels_per_degree);
  const Seen b = look_at(test, pixels_per_degree);
  const double largest = colour_distance(hunt_lab_of({0, 1, 0}), hunt_lab_of({0, 0, 1}));
  const double knee = kColourKnee * largest;

  std::vector<float> result(a.colour.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    // Colour: linear below the knee, then slowly up to 1.
    const double distance = colour_distance(a.colour[i], b.colour[i]);
    const double colour =
        distance < knee
            ? distance * kColourKneeValue / knee
            : kColourKneeValue + (distance - knee) / (largest - knee) * (1 - kColourKneeValue);

    // Features make a difference of colour count more.
    const double edge = std::abs(a.feature[0].values[i] - b.feature[0].values[i]);
    const double point = std::abs(a.feature[1].values[i] - b.feature[1].values[i]);
    const double feature = std::pow(std::max(edge, point) / std::numbers::sqrt2, kFeatureExponent);
    const double difference =
        std::pow(std::clamp(colour, 0.0, 1.0), 1 - std::clamp(feature, 0.0, 1.0));
    result[i] = static_cast<float>(distance > 0 ? difference : 0.0);
  }
  return result;
}

}  // namespace baton
