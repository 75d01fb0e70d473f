#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "common/math/philox.h"
#include "common/math/vec3.h"
#include "tests/support/special_functions.h"

namespace baton::test {

/// Level of each of `num_tests` independent tests so that all together raise a false alarm with
/// probability `level` [Sidak 1967].
inline double sidak_level(double level, int num_tests) {
  return -std::expm1(std::log1p(-level) / num_tests);
}

/// Two-sided p-value of an estimate whose standard error is known.
inline double z_test_p_value(double estimate, double expected, double standard_error) {
  return std::erfc(std::fabs(estimate - expected) / (standard_error * std::sqrt(2.0)));
}

/// Two-sided p-value of a mean whose standard error was estimated with `degrees_of_freedom`:
/// Student's t.
inline double t_test_p_value(double estimate, double expected, double standard_error,
                             double degrees_of_freedom) {
  const double t = (estimate - expected) / standard_error;
  return incomplete_beta(degrees_of_freedom / 2, 0.5,
                         degrees_of_freedom / (degrees_of_freedom + t * t));
}

struct ChiSquareResult {
  double statistic = 0;
  int degrees_of_freedom = 0;
  double p_value = 1;
};

/// Pearson's goodness of fit. Cells that expect less than `min_expected` are pooled, smallest
/// first; samples where nothing at all is expected give p = 0. expected: (cells), counts; sums to
/// the number of samples unless the density is wrong.
inline ChiSquareResult chi_square_test(std::span<const double> observed,
                                       std::span<const double> expected, double min_expected = 5) {
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });

  // Join cells from the smallest up.
  ChiSquareResult result;
  double pooled_observed = 0;
  double pooled_expected = 0;
  int cells = 0;
  for (const std::size_t i : order) {
    pooled_observed += observed[i];
    pooled_expected += expected[i];
    if (!(pooled_expected >= min_expected)) continue;
    const double difference = pooled_observed - pooled_expected;
    result.statistic += difference * difference / pooled_expected;
    ++cells;
    pooled_observed = pooled_expected = 0;
  }

  // The largest cell ends the pooling, so something is left only if next to nothing was expected
  // anywhere.
  if (cells == 0) return {0, 0, pooled_observed > 0 ? 0.0 : 1.0};
  result.degrees_of_freedom = std::max(cells - 1, 1);
  result.p_value = upper_gamma(result.degrees_of_freedom / 2.0, result.statistic / 2);
  return result;
}

/// A partition of the sphere around an axis, finer towards it: 1 - cos(angle to axis) = 2 t^power,
/// t in `num_rings` equal parts, times `num_sectors` equal sectors.
struct SphereGrid {
  Vec3 axis{0, 0, 1};
  int num_rings = 24;
  int num_sectors = 32;
  /// 1: equal solid angles; larger for sharp lobes.
  double power = 1;

  std::size_t num_cells() const { return static_cast<std::size_t>(num_rings) * num_sectors; }

  /// Cell of unit w. |w - axis|^2 / 2 keeps the digits of 1 - cos near the axis.
  std::size_t cell_of(const Vec3& w) const {
    const Vec3 local = Frame(axis).to_local(w);
    const double dz = local.z - 1.0;
    const double one_minus_cos =
        0.5 * (double{local.x} * local.x + double{local.y} * local.y + dz * dz);
    const double t = std::pow(std::clamp(one_minus_cos / 2, 0.0, 1.0), 1 / power);
    const double turns = std::atan2(local.y, local.x) / (2 * 3.14159265358979323846) + 0.5;
    const int ring = std::min(static_cast<int>(t * num_rings), num_rings - 1);
    const int sector = std::min(static_cast<int>(turns * num_sectors), num_sectors - 1);
    return static_cast<std::size_t>(ring) * num_sectors + sector;
  }

  /// Integral of `pdf` over every cell: the midpoint rule, refined where halving its intervals
  /// changes the value. Densities may jump (visible normals do, at grazing view).
  template <class Pdf>
  std::vector<double> integrate(const Pdf& pdf) const {
    constexpr int kMinSteps = 8;
    constexpr int kMaxSteps = 192;
    const Frame frame(axis);
    std::vector<double> integral(num_cells(), 0.0);
    for (std::size_t cell = 0; cell < integral.size(); ++cell) {
      double coarse = integrate_cell(pdf, frame, cell, kMinSteps);
      for (int steps = 2 * kMinSteps; steps <= kMaxSteps; steps *= 2) {
        integral[cell] = integrate_cell(pdf, frame, cell, steps);
        if (std::fabs(integral[cell] - coarse) < 1e-3 * integral[cell] + 1e-8) break;
        coarse = integral[cell];
      }
    }
    return integral;
  }

 private:
  /// Midpoint rule of steps x steps points.
  template <class Pdf>
  double integrate_cell(const Pdf& pdf, const Frame& frame, std::size_t cell, int steps) const {
    constexpr double kTwoPi = 2 * 3.14159265358979323846;
    const auto ring = static_cast<double>(cell / num_sectors);
    const auto sector = static_cast<double>(cell % num_sectors);
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      const double low = 2 * std::pow((ring + static_cast<double>(i) / steps) / num_rings, power);
      const double high = 2 * std::pow((ring + (i + 1.0) / steps) / num_rings, power);
      const double one_minus_cos = 0.5 * (low + high);
      const double sine = std::sqrt(one_minus_cos * (2 - one_minus_cos));
      for (int j = 0; j < steps; ++j) {
        const double angle = ((sector + (j + 0.5) / steps) / num_sectors - 0.5) * kTwoPi;
        const Vec3 w = frame.to_world({static_cast<float>(sine * std::cos(angle)),
                                       static_cast<float>(sine * std::sin(angle)),
                                       static_cast<float>(1 - one_minus_cos)});
        sum += static_cast<double>(pdf(w)) * (high - low);
      }
    }
    return sum * kTwoPi / (static_cast<double>(num_sectors) * steps);
  }
};

/// Four uniforms of test sample `i`: the same in every process.
inline std::array<float, 4> test_uniforms(std::uint32_t seed, std::uint32_t i) {
  return Rng(RngKey{.job_seed = seed}, PassId::reference).uniforms(0, i);
}

/// Chi-square of a sampler against its density. sampler: array<float, 4> of uniforms -> unit Vec3;
/// pdf: unit Vec3 -> 1/sr.
template <class Sampler, class Pdf>
ChiSquareResult chi_square_sphere(const Sampler& sampler, const Pdf& pdf, const SphereGrid& grid,
                                  int num_samples, std::uint32_t seed = 1) {
  std::vector<double> expected = grid.integrate(pdf);
  std::vector<double> observed(grid.num_cells(), 0.0);
  for (int i = 0; i < num_samples; ++i) {
    observed[grid.cell_of(sampler(test_uniforms(seed, static_cast<std::uint32_t>(i))))] += 1;
  }
  for (double& e : expected) e *= num_samples;
  return chi_square_test(observed, expected);
}

}  // namespace baton::test
