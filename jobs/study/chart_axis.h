#pragma once

#include <string>
#include <vector>

namespace baton {

/// How values are laid out: by their logarithm (those at or below 0 are left out), evenly, or
/// evenly with ticks at whole numbers only.
enum class AxisScale { log, linear, whole };

/// An axis of a chart: from values to positions in pixels.
class ChartAxis {
 public:
  /// values: what must lie on it; those that the scale leaves out are ignored. begin, end: pixels.
  ChartAxis(const std::vector<double>& values, AxisScale scale, double begin, double end);

  double position(double value) const;
  bool shows(double value) const { return scale_ != AxisScale::log || value > 0; }

  struct Tick {
    double value = 0;
    std::string label;  ///< empty: a minor one
  };
  /// Decades with 2 and 5 between them, or round steps.
  std::vector<Tick> ticks() const;

 private:
  double scaled(double value) const;

  AxisScale scale_;
  double low_ = 0, high_ = 1;  ///< scaled
  double begin_, end_;
};

}  // namespace baton
