#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/study/chart_axis.h"

namespace baton {

struct ChartPoint {
  double x = 0, y = 0;
  double low = 0, high = 0;  ///< the band around y
  /// Shown when the pointer rests on it, and beside it when `marked`.
  std::string label;
  bool marked = false;  ///< on the Pareto front: with a ring
  bool hollow = false;  ///< not resolved by the reference
};

struct ChartSeries {
  std::string name;
  /// Index into the palette, which repeats after eight, dashed.
  int colour = 0;
  std::vector<ChartPoint> points;  ///< in the order in which they are joined
};

struct Chart {
  std::string title, x_label, y_label;
  AxisScale x_scale = AxisScale::log, y_scale = AxisScale::log;
  std::vector<ChartSeries> series;
  /// A line across: what the reference cannot resolve.
  std::optional<double> floor;
};

/// An image of the chart, 620 x 400 pixels, with ticks, bands, markers and a legend. Deterministic.
std::string svg_chart(const Chart& chart);

/// The palette's colour for a series, as #rrggbb.
const char* series_colour(int colour);

}  // namespace baton
