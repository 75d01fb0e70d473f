#include "jobs/lab/stability/laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/special_functions.h"

namespace baton::stability {
namespace {

constexpr std::array<const char*, 3> kNames{"holds", "degrades", "fails"};

double beyond_interval(double offset, double interval) {
  return std::max(std::fabs(offset) - interval, 0.0);
}

double quotient(double a, double b) { return b > 0 ? a / b : (a > 0 ? 1e9 : 1.0); }

/// The value that a law compares with its tolerances.
double value_of(Measure measure, const Numbers& n, const Numbers& fresh) {
  switch (measure) {
    case Measure::unlawful:
      return static_cast<double>(n.unlawful);
    case Measure::negative:
      return n.negative;
    case Measure::bias:
      return beyond_interval(n.bias, n.bias_interval);
    case Measure::lns_bias:
      return beyond_interval(n.lns_mean - 1, n.lns_mean_interval);
    case Measure::lns_median:
      return n.lns_median > 0 ? std::max(n.lns_median, 1 / n.lns_median) - 1 : 1e9;
    case Measure::noise:
      return quotient(n.noise, fresh.noise);
    case Measure::noise_shown:
      return quotient(n.noise_shown, fresh.noise_shown);
    case Measure::black:
      return n.black - fresh.black;
    case Measure::noise_after:
      return quotient(n.noise_after, fresh.noise_after);
    case Measure::lost:
      return n.lost;
    case Measure::growth:
      return quotient(n.growth, fresh.growth);
  }
  return 0;
}

std::string words_of(Measure measure, const Numbers& n, const Numbers& fresh) {
  const double value = value_of(measure, n, fresh);
  switch (measure) {
    case Measure::unlawful:
      return fmt::format("{} unlawful values", n.unlawful);
    case Measure::negative:
      return fmt::format("{:.1g} % of pixels negative", 100 * n.negative);
    case Measure::bias:
      return fmt::format("bias {:+.1f} ± {:.1f} %", 100 * n.bias, 100 * n.bias_interval);
    case Measure::lns_bias:
      return fmt::format("mean Lns^/Lns {:.2f} ± {:.2f}", n.lns_mean, n.lns_mean_interval);
    case Measure::lns_median:
      return fmt::format("median Lns^/Lns {:.2f}", n.lns_median);
    case Measure::noise:
      return fmt::format("noise x{:.1f}", value);
    case Measure::noise_shown:
      return fmt::format("noise as shown x{:.1f}", value);
    case Measure::black:
      return fmt::format("{:.1g} % of pixels black", 100 * n.black);
    case Measure::noise_after:
      return fmt::format("noise x{:.1f} after the jump", value);
    case Measure::lost:
      return fmt::format("{:.0f} % of pixels dark", 100 * n.lost);
    case Measure::growth:
      return fmt::format("growth of Lns error x{:.1f}", value);
  }
  return {};
}

Verdict verdict_of(const Law& law, double value) {
  // A NaN is worse than any number.
  if (!(value <= law.fails)) return Verdict::fails;
  return value > law.degrades ? Verdict::degrades : Verdict::holds;
}

}  // namespace

std::string to_string(Verdict verdict) { return kNames[static_cast<std::size_t>(verdict)]; }

bool from_string(const std::string& text, Verdict& verdict) {
  const auto found = std::find(kNames.begin(), kNames.end(), text);
  if (found == kNames.end()) return false;
  verdict = static_cast<Verdict>(found - kNames.begin());
  return true;
}

Judgement judge(const std::vector<Law>& laws, const Numbers& numbers, const Numbers& fresh) {
  Judgement result;
  double tightest = -1;
  for (const Law& law : laws) {
    const double value = value_of(law.measure, numbers, fresh);
    const Verdict verdict = verdict_of(law, value);
    // Among equal verdicts the law that is broken most speaks.
    const double strain = law.degrades > 0 ? value / law.degrades : (value > 0 ? 1e9 : 0.0);
    if (verdict > result.verdict || (verdict == result.verdict && strain > tightest)) {
      tightest = strain;
      result.number = words_of(law.measure, numbers, fresh);
    }
    result.verdict = std::max(result.verdict, verdict);
    result.lowest = std::max(result.lowest, verdict_of(law, value / kEdge));
    result.highest = std::max(result.highest, verdict_of(law, value * kEdge));
  }
  return result;
}

double student_limit(int dof, double level) {
  const auto exceeded = [dof](double t) {
    return test::incomplete_beta(0.5 * dof, 0.5, dof / (dof + t * t));
  };
  double low = 0;
  double high = 1;
  while (exceeded(high) > level) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (exceeded(middle) > level ? low : high) = middle;
  }
  return high;
}

}  // namespace baton::stability
