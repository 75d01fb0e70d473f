#include "jobs/study/chart_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

/// Room left at either end, as a share of the axis.
constexpr double kMargin = 0.06;
constexpr double kMaxLinearTicks = 6;
/// From so many decades on only decades are labelled.
constexpr double kWideDecades = 2.5;

std::string tick_label(double value) {
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-3 || size >= 1e5)) {
    const int exponent = static_cast<int>(std::floor(std::log10(size) + 1e-9));
    return fmt::format("{:g}e{}", value / std::pow(10.0, exponent), exponent);
  }
  return fmt::format("{:g}", value);
}

}  // namespace

ChartAxis::ChartAxis(const std::vector<double>& values, AxisScale scale, double begin, double end)
    : scale_(scale), begin_(begin), end_(end) {
  bool first = true;
  for (const double value : values) {
    if (!shows(value) || !std::isfinite(value)) continue;
    const double at = scaled(value);
    low_ = first ? at : std::min(low_, at);
    high_ = first ? at : std::max(high_, at);
    first = false;
  }
  if (first) high_ = (low_ = 0) + 1;
  const double least = scale_ == AxisScale::log ? 0.3 : 1e-6 + 0.02 * std::abs(high_);
  const double margin = std::max((high_ - low_) * kMargin, 0.5 * (least - (high_ - low_)));
  low_ -= margin;
  high_ += margin;
}

double ChartAxis::scaled(double value) const {
  return scale_ == AxisScale::log ? std::log10(value) : value;
}

double ChartAxis::position(double value) const {
  return begin_ + (scaled(value) - low_) / (high_ - low_) * (end_ - begin_);
}

std::vector<ChartAxis::Tick> ChartAxis::ticks() const {
  std::vector<Tick> ticks;
  if (scale_ == AxisScale::log) {
    const bool wide = high_ - low_ > kWideDecades;
    for (int decade = static_cast<int>(std::floor(low_)); decade <= high_; ++decade) {
      for (const int digit : {1, 2, 5}) {
        const double value = digit * std::pow(10.0, decade);
        const double at = std::log10(value);
        if (at < low_ || at > high_) continue;
        ticks.push_back({value, digit == 1 || !wide ? tick_label(value) : ""});
      }
    }
    return ticks;
  }

  // The largest of 1, 2 and 5 times a power of ten that leaves few enough.
  const double rough = (high_ - low_) / kMaxLinearTicks;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough) step = factor * power;
  }
  if (scale_ == AxisScale::whole) step = std::max(step, 1.0);
  for (double i = std::ceil(low_ / step); i * step <= high_; ++i) {
    const double value = i == 0 ? 0 : i * step;
    ticks.push_back({value, tick_label(value)});
  }
  return ticks;
}

}  // namespace baton
