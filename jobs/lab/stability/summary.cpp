#include "jobs/lab/stability/summary.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/image/as_shown.h"

namespace baton::stability {
namespace {

/// Pixels dimmer than this share of the frame's mean Lns are not asked for Lns^/Lns.
constexpr double kLitShare = 0.02;

double mean_of(const std::vector<double>& values) {
  return values.empty() ? 0.0
                        : std::accumulate(values.begin(), values.end(), 0.0) /
                              static_cast<double>(values.size());
}

/// The value that a share q of `values` lies below. values are reordered.
double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Half-width of the interval of the mean of independent values.
double interval(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (n < 2) return 1e9;
  const double mean = mean_of(values);
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return student_limit(static_cast<int>(n) - 1, kIntervalLevel) * std::sqrt(squares / (n - 1) / n);
}

/// All errors of one judged frame, relative to the exact answer.
struct FrameErrors {
  bool lit = false;
  std::vector<double> ratio;         ///< Lns^/Lns of lit pixels, all renderings
  std::vector<double> error;         ///< (I - R) / mean R, pixels and renderings
  std::vector<double> ratio_of_run;  ///< (renderings) mean
  std::vector<double> error_of_run;  ///< (renderings) mean
  double shown_square = 0;           ///< mean squared error as shown
  double black = 0;                  ///< share of wrong zeros
  double mean_square() const {
    double sum = 0;
    for (const double e : error) sum += e * e;
    return error.empty() ? 0.0 : sum / static_cast<double>(error.size());
  }
};

FrameErrors errors_of(const FrameTruth& truth, const std::vector<std::vector<float>>& radiance,
                      const std::vector<std::vector<float>>& lns) {
  FrameErrors out;
  const double mean_lns = mean_of(truth.lns);
  const double mean_radiance = mean_of(truth.radiance);
  out.lit = mean_lns > 0 && mean_radiance > 0;
  if (!out.lit) return out;
  const std::vector<float> exact(truth.radiance.begin(), truth.radiance.end());
  const double exposure = exposure_as_shown(exact);
  const auto shown = [exposure](double value) {
    return double{encode_srgb(static_cast<float>(exposure * value))};
  };
  const auto share = 1 / static_cast<double>(radiance.size() * exact.size());
  for (std::size_t r = 0; r < radiance.size(); ++r) {
    std::vector<double> ratio;
    std::vector<double> error;
    for (std::size_t p = 0; p < truth.lns.size(); ++p) {
      error.push_back((radiance[r][p] - truth.radiance[p]) / mean_radiance);
      const double off = shown(radiance[r][p]) - shown(truth.radiance[p]);
      out.shown_square += share * off * off;
      if (truth.radiance[p] > 0 && !(radiance[r][p] > 0)) out.black += share;
      if (truth.lns[p] > kLitShare * mean_lns) ratio.push_back(lns[r][p] / truth.lns[p]);
    }
    out.ratio_of_run.push_back(mean_of(ratio));
    out.error_of_run.push_back(mean_of(error));
    out.ratio.insert(out.ratio.end(), ratio.begin(), ratio.end());
    out.error.insert(out.error.end(), error.begin(), error.end());
  }
  return out;
}

FramePoint point_of(int frame, FrameErrors errors, double ess) {
  FramePoint point{.frame = frame, .lns_mean = mean_of(errors.ratio), .ess = ess};
  point.lns_median = quantile(errors.ratio, 0.5);
  point.lns_low = quantile(errors.ratio, 0.05);
  point.lns_high = quantile(errors.ratio, 0.95);
  point.bias = mean_of(errors.error);
  point.noise = std::sqrt(errors.mean_square());
  return point;
}

double ratio_error(const std::vector<double>& ratio) {
  double squares = 0;
  for (const double r : ratio) squares += (r - 1) * (r - 1);
  return ratio.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(ratio.size()));
}

/// E[(dI - dR)^2] / (2 MSE) over pairs of neighbouring frames.
double flicker(const std::vector<int>& frames, const std::vector<FrameErrors>& errors, int late) {
  double changes = 0;
  double squares = 0;
  for (std::size_t f = 1; f < frames.size(); ++f) {
    const FrameErrors& a = errors[f - 1];
    const FrameErrors& b = errors[f];
    if (frames[f] != frames[f - 1] + 1 || frames[f - 1] < late || !a.lit || !b.lit) continue;
    for (std::size_t i = 0; i < a.error.size(); ++i) {
      changes += (b.error[i] - a.error[i]) * (b.error[i] - a.error[i]);
      squares += b.error[i] * b.error[i] + a.error[i] * a.error[i];
    }
  }
  return squares > 0 ? changes / squares : 0.0;
}

/// What is measured in the late window.
void summarise_late(const std::vector<FrameErrors>& late, Numbers& n) {
  std::vector<double> ratio;
  std::vector<double> error;
  std::vector<double> ratio_of_run;
  std::vector<double> error_of_run;
  double squares = 0, shown_squares = 0;
  for (const FrameErrors& e : late) {
    ratio.insert(ratio.end(), e.ratio.begin(), e.ratio.end());
    for (const double v : e.error) error.push_back(std::fabs(v));
    squares += e.mean_square() / static_cast<double>(late.size());
    shown_squares += e.shown_square / static_cast<double>(late.size());
    n.black += e.black / static_cast<double>(late.size());
    ratio_of_run.resize(e.ratio_of_run.size());
    error_of_run.resize(e.error_of_run.size());
    for (std::size_t r = 0; r < ratio_of_run.size(); ++r) {
      ratio_of_run[r] += e.ratio_of_run[r] / static_cast<double>(late.size());
      error_of_run[r] += e.error_of_run[r] / static_cast<double>(late.size());
    }
  }
  n.bias = mean_of(error_of_run);
  n.bias_interval = interval(error_of_run);
  n.lns_mean = mean_of(ratio_of_run);
  n.lns_mean_interval = interval(ratio_of_run);
  n.noise = std::sqrt(squares);
  n.noise_shown = std::sqrt(shown_squares);
  n.growth = ratio_error(ratio);
  n.lost = ratio.empty() ? 0.0
                         : static_cast<double>(std::count_if(
                               ratio.begin(), ratio.end(), [](double r) { return !(r >= 0.1); })) /
                               static_cast<double>(ratio.size());
  n.lns_median = quantile(ratio, 0.5);
  n.tail = quantile(error, 0.999);
}

/// Light that the samplers see where the map is black.
std::uint64_t light_in_the_dark(const FrameTruth& truth,
                                const std::vector<std::vector<float>>& radiance) {
  if (mean_of(truth.lns) > 0) return 0;
  std::uint64_t count = 0;
  for (const auto& run : radiance) {
    count += static_cast<std::uint64_t>(
        std::count_if(run.begin(), run.end(), [](float v) { return v > 0; }));
  }
  return count;
}

}  // namespace

Summary summarise(const Timeline& time, const Truth& truth, const Observations& seen) {
  std::vector<int> frames;
  for (const FrameNumber number : time.judged()) frames.push_back(number.value());
  Summary summary;
  Numbers& n = summary.numbers;
  n.unlawful = seen.unlawful;
  if (seen.pixels > 0)
    n.negative = static_cast<double>(seen.negative) / static_cast<double>(seen.pixels);

  // Compare frame by frame.
  std::vector<FrameErrors> errors;
  std::vector<FrameErrors> late;
  std::vector<double> squares_after;
  std::vector<double> ess;
  std::vector<double> acceptance;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    errors.push_back(errors_of(truth.frames[f], seen.radiance[f], seen.lns[f]));
    n.unlawful += light_in_the_dark(truth.frames[f], seen.radiance[f]);
    if (!errors[f].lit) continue;
    summary.series.push_back(point_of(frames[f], errors[f], seen.ess[f]));
    if (frames[f] >= time.late()) {
      late.push_back(errors[f]);
      ess.push_back(seen.ess[f]);
      acceptance.push_back(seen.acceptance[f]);
    }
    if (time.event > 0 && (frames[f] == time.event || frames[f] == time.event + 1)) {
      squares_after.push_back(errors[f].mean_square());
    }
  }

  // Draw the windows together.
  summarise_late(late, n);
  const auto first =
      std::find_if(errors.begin(), errors.end(), [](const FrameErrors& e) { return e.lit; });
  const double early = first == errors.end() ? 0.0 : ratio_error(first->ratio);
  n.growth = early > 0 ? n.growth / early : 1.0;
  n.noise_after = std::sqrt(mean_of(squares_after));
  n.flicker = flicker(frames, errors, time.late());
  n.ess = mean_of(ess);
  n.acceptance = mean_of(acceptance);
  const auto surface = static_cast<double>(seen.stats.pixels - seen.stats.pixels_background);
  if (surface > 0) {
    n.restarted = static_cast<double>(seen.stats.sampling.pixels_restarted) / surface;
    n.refreshed = static_cast<double>(seen.stats.sampling.pixels_refreshed) / surface;
    n.resampled = static_cast<double>(seen.stats.sampling.pixels_resampled) / surface;
  }
  return summary;
}

}  // namespace baton::stability
