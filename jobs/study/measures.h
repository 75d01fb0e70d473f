#pragma once

#include <limits>
#include <vector>

#include "common/job/time.h"
#include "jobs/study/measured_frame.h"

namespace baton {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// What one frame of one rendering measures, over the pixels with a surface. Squared errors are
/// taken as (I - A)(I - B) with the halves A and B of the reference: their expectation is the error
/// against the truth, free of the reference's own noise (a value below zero is such noise).
struct FrameMeasures {
  FrameNumber frame{};
  double mse = 0;      ///< over R, G, B
  double rel_mse = 0;  ///< mean of (I - R)^2 / (R + .01)^2
  /// Mean LDR-FLIP of the tone-mapped images, [0, 1].
  double flip = 0;
  /// 99.9th percentile of |I - R|, the mean over R, G, B of a pixel.
  double percentile_99_9 = 0;
  ErrorAsShown shown{};
  /// Mean of I - R, signed; noise of the rendering included.
  double bias = 0;
  double lns_mean = 0;  ///< mean Lns over mean Lns of the reference
  /// Median over pixels of Lns / Lns of the reference.
  double lns_median = 0;
  double ess = 0;         ///< mean ESS / N
  double acceptance = 0;  ///< mean share of accepted moves; of pixels
  /// E[(dI - dR)^2] / (E[(I - R)^2] + E[(I' - R')^2]) with the frame before: 1 for errors that are
  /// independent from frame to frame, 0 for errors that stand still. kNotMeasured without it.
  double flicker = kNotMeasured;
  /// By block of the reference: its share of `mse`; they add up to it.
  std::vector<double> block_mse{};
};

/// test: of the size of the reference.
FrameMeasures measure_frame(const MeasuredFrame& test, const Reference& reference);

/// The flicker between two consecutive frames (see FrameMeasures::flicker).
double measure_flicker(const MeasuredFrame& before, const Reference& reference_before,
                       const MeasuredFrame& now, const Reference& reference_now);

}  // namespace baton
