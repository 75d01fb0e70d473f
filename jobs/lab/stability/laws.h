#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace baton::stability {

/// What is measured of a method on a case. Relative to the exact answer; "late" is the last quarter
/// of the frames. Intervals are Student's over independent runs at kIntervalLevel, two-sided.
struct Numbers {
  std::uint64_t unlawful =
      0;  ///< values that are NaN or infinite, or pixels with light where the map is black
  double negative = 0;                         ///< share of pixels with a value below 0
  double bias = 0, bias_interval = 0;          ///< late: mean radiance - 1, and its half-width
  double lns_mean = 1, lns_mean_interval = 0;  ///< late: mean Lns^/Lns, and its half-width
  double lns_median = 1;           ///< late: median Lns^/Lns over pixels, frames and runs
  double noise = 0;                ///< late: root mean square error of a pixel / mean radiance
  double noise_after = 0;          ///< the same in the two frames from the light's jump on
  double tail = 0;                 ///< late: 99.9th percentile of a pixel's error / mean radiance
  double lost = 0;                 ///< late: share of lit pixels with Lns^ < Lns / 10
  double growth = 1;               ///< root mean square of Lns^/Lns - 1, late over first frame
  double flicker = 0;              ///< late: E[(dI - dR)^2] / (2 MSE); 1 for independent frames
  double ess = 0, acceptance = 0;  ///< late: mean ESS / N and share of accepted moves
  double restarted = 0, refreshed = 0, resampled = 0;  ///< share of surface pixels, all frames
};
inline constexpr double kIntervalLevel = 1e-4;

/// What a law looks at.
enum class Measure : std::uint8_t {
  unlawful,
  negative,
  bias,         ///< how far the interval of `bias` stays from 0
  lns_bias,     ///< how far the interval of `lns_mean` stays from 1
  lns_median,   ///< max(m, 1/m) - 1 of lns_median
  noise,        ///< noise / noise of fresh samples (`bidirectional`, same N and M)
  noise_after,  ///< likewise right after the jump
  lost,
  growth,  ///< growth / growth of fresh samples, for which only the light has changed
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
  std::string number;  ///< what decided, in words: "median Lns^/Lns 0.41"
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
