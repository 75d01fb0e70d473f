#pragma once

#include <string>
#include <vector>

namespace baton {

/// An axis of a chart: from values to positions in pixels.
class ChartAxis {
 public:
  /// values: what must lie on it; those at or below 0 are ignored when `log`. begin, end: pixels.
  ChartAxis(const std::vector<double>& values, bool log, double begin, double end);

  double position(double value) const;
  bool shows(double value) const { return !log_ || value > 0; }

  struct Tick {
    double value = 0;
    std::string label;  ///< empty: a minor one
  };
  /// Decades with 2 and 5 between them, or round steps.
  std::vector<Tick> ticks() const;

 private:
  double scaled(double value) const;

  bool log_;
  double low_ = 0, high_ = 1;  ///< scaled
  double begin_, end_;
};

}  // namespace baton
