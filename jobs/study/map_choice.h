#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace baton {

/// The systematic difference between pictures under a coarser map and under the map as it is,
/// relative to their mean radiance, with standard errors over seeds.
struct SystematicDifference {
  double square = 0;  ///< its mean square, free of the noise of both: below zero is such noise
  double square_error = 0;
  double mean = 0;  ///< its mean, signed
  double mean_error = 0;
};

/// differences: (seeds, values) of a coarser map's picture less the other's, of one seed each; at
/// least three seeds, independent of one another. The square is the mean over pairs of seeds of the
/// products of their differences, its error the jackknife's [Efron & Stein 1981].
/// mean_radiance: of the pictures, above 0.
SystematicDifference systematic_difference(std::span<const std::vector<float>> differences,
                                           double mean_radiance);

enum class MapVerdict { harmless, harmful, open };

/// Whether the difference is below kMapShare of `error`, the expected RMSE over mean radiance, and
/// its mean unresolved or below a thousandth; `open`: not enough seeds to say.
MapVerdict judge_map(const SystematicDifference& seen, double error);
inline constexpr double kMapShare = 0.15;
/// The upper limit of the root of the square difference that judge_map goes by.
double difference_limit(const SystematicDifference& seen);

/// Halves, quarters and so on of a map's width down to 64 columns, coarsest first.
std::vector<int> coarser_widths(int width);

/// The first of the ascending widths that is harmless, if those above a harmless one are, too: by
/// bisection, the coarsest first. nullopt: none.
Result<std::optional<int>> coarsest_harmless(
    std::span<const int> widths, const std::function<Result<bool>(int width)>& is_harmless);

}  // namespace baton
