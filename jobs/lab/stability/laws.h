#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace baton::stability {

/// What is measured of a method on a case. Relative to the exact answer; "late" is the last quarter
/// of the frames. Intervals are Student's over independent renderings at kIntervalLevel, two-sided.
struct Numbers {
  /// Values that are NaN or infinite, or pixels with light where the map is black.
  std::uint64_t unlawful = 0;
  double negative = 0;                         ///< share of pixels with a value below 0
  double bias = 0, bias_interval = 0;          ///< late: mean radiance - 1, and half-width
  double lns_mean = 1, lns_mean_interval = 0;  ///< late: mean Lns^/Lns, and its half-width
  /// late: median Lns^/Lns over pixels, frames and renderings.
  double lns_median = 1;
  double noise = 0;  ///< late: RMSE of a pixel / mean radiance
  /// late: RMSE of a pixel of the picture as shown (common/image/as_shown.h), at the exposure of
  /// the exact answer of each frame.
  double noise_shown = 0;
  double black = 0;  ///< late: share of wrong zeros
  /// Noise in the two frames from the light's jump on.
  double noise_after = 0;
  /// late: 99.9th percentile of a pixel's error / mean radiance.
  double tail = 0;
  /// late: share of lit pixels with Lns^ < Lns / 10.
  double lost = 0;
  /// Root mean square of Lns^/Lns - 1, late over first frame.
  double growth = 1;
  /// late: E[(dI - dR)^2] / (2 MSE); 1 for independent frames.
  double flicker = 0;
  /// late: mean ESS / N and share of accepted moves.
  double ess = 0, acceptance = 0;
  double restarted = 0, refreshed = 0, resampled = 0;  ///< share of surface pixels, all frames
};
inline constexpr double kIntervalLevel = 1e-4;

/// What a law judges.
enum class Measure : std::uint8_t {
  unlawful,
  negative,
  bias,        ///< distance of `bias`'s interval from 0
  lns_bias,    ///< distance of `lns_mean`'s interval from 1
  lns_median,  ///< max(m, 1/m) - 1 of lns_median
  /// Noise over that of fresh samples (`bidirectional`, same N and M).
  noise,
  noise_shown,  ///< as `noise`, as shown
  noise_after,  ///< as `noise`, right after the jump
  /// Beyond that of fresh samples.
  black,
  lost,
  /// Growth over that of fresh samples, for which only the light has changed.
  growth,
};

/// A law and its tolerances: the case degrades above one, fails above the other.
struct Law {
  Measure measure;
  double degrades = 0;
  double fails = 0;
};

enum class Verdict : std::uint8_t { holds, degrades, fails };
std::string to_string(Verdict verdict);
/// False when the text is none of the three words.
bool from_string(const std::string& text, Verdict& verdict);

/// The verdict of all laws together and the law that decided (the tightest one when all hold).
struct Judgement {
  Verdict verdict = Verdict::holds;
  /// What decided, in words: "median Lns^/Lns 0.41".
  std::string number;
  /// The verdicts that values a factor kEdge lower or higher would have given: a recorded verdict
  /// in between is no change.
  Verdict lowest = Verdict::holds, highest = Verdict::holds;
};
inline constexpr double kEdge = 1.5;

/// fresh: the numbers of `bidirectional` on the same case.
Judgement judge(const std::vector<Law>& laws, const Numbers& numbers, const Numbers& fresh);

/// Half-width factor: |t| of Student's distribution that is exceeded with probability `level`,
/// two-sided. dof >= 1.
double student_limit(int dof, double level);

}  // namespace baton::stability
