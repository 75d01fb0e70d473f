#include "jobs/study/study_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

bool belongs(const StudyCell& cell, std::size_t scene, std::size_t method) {
  return cell.scene == scene && cell.method == method;
}

/// Marks the points of all series that no other beats.
void mark_front(Chart& chart) {
  std::vector<double> costs, errors;
  for (const ChartSeries& series : chart.series) {
    for (const ChartPoint& point : series.points) {
      costs.push_back(point.x);
      errors.push_back(point.y);
    }
  }
  const std::vector<bool> front = pareto_front(costs, errors);
  std::size_t at = 0;
  for (ChartSeries& series : chart.series) {
    for (ChartPoint& point : series.points) point.marked = front[at++];
  }
}

Chart error_chart(const Study& study, const StudyResults& results, std::size_t scene,
                  FrameChoice frame, ErrorKindOfImage kind, bool against_rays) {
  Chart chart;
  chart.x_label = against_rays ? "shadow rays per pixel and frame"
                               : "CPU time per pixel and frame [microseconds]";
  chart.y_label = name_of(kind);
  chart.title = fmt::format(
      "{}: {}, {}", study.scenes[scene].name, name_of(kind),
      frame ? fmt::format("frame {}", study.scenes[scene].frames[*frame]) : "all measured frames");
  const double floor = reference_error(results.references[scene], kind, frame);
  chart.floor = floor;
  for (std::size_t m = 0; m < study.methods.size(); ++m) {
    ChartSeries series{study.methods[m], static_cast<int>(m), {}};
    for (std::size_t c = 0; c < study.cells.size(); ++c) {
      if (!belongs(study.cells[c], scene, m)) continue;
      const CellCost cost = cell_cost(results.runs[c]);
      const Interval error = cell_error(results.runs[c], kind, frame);
      series.points.push_back({against_rays ? cost.rays : cost.cpu_us, error.value, error.low,
                               error.high, study.cells[c].budget, false, error.value < floor});
    }
    chart.series.push_back(std::move(series));
  }
  mark_front(chart);
  return chart;
}

/// A measure of the sampler over frames.
struct Course {
  const char* name;
  const char* label;
  double FrameMeasures::*value;
  AxisScale scale;
};
constexpr Course kCourses[] = {
    {"rmse", "RMSE", &FrameMeasures::mse, AxisScale::log},
    {"bias", "bias over mean radiance", &FrameMeasures::bias, AxisScale::linear},
    {"lns", "Lns / Lns of the reference, median", &FrameMeasures::lns_median, AxisScale::linear},
    {"ess", "ESS / N", &FrameMeasures::ess, AxisScale::linear},
    {"acceptance", "moves accepted", &FrameMeasures::acceptance, AxisScale::linear},
    {"flicker", "flicker", &FrameMeasures::flicker, AxisScale::linear},
};

ChartPoint course_point(const Course& course, const StudyResults& results, std::size_t scene,
                        std::size_t cell, std::size_t frame, FrameNumber number) {
  std::vector<double> values;
  for (const RunRecord& run : results.runs[cell]) values.push_back(run.frames[frame].*course.value);
  Interval i = mean_interval(values);
  if (course.value == &FrameMeasures::mse) {
    i = cell_error(results.runs[cell], ErrorKindOfImage::rmse, frame);
  } else if (course.value == &FrameMeasures::bias) {
    const double mean = std::max(results.references[scene][frame].mean_radiance, 1e-12);
    i = {i.low / mean, i.value / mean, i.high / mean};
  }
  return {static_cast<double>(number.value()), i.value, i.low, i.high,
          fmt::format("{}", number),           false,   false};
}

}  // namespace

std::vector<NamedChart> error_charts(const Study& study, const StudyResults& results,
                                     std::size_t scene, FrameChoice frame) {
  std::vector<NamedChart> charts;
  for (const bool against_rays : {false, true}) {
    for (const ErrorKindOfImage kind : kImageErrors) {
      const std::string suffix =
          frame ? fmt::format("-frame{}", study.scenes[scene].frames[*frame]) : "";
      charts.push_back(
          {fmt::format("{}-{}-{}{}.svg", file_slug(study.scenes[scene].name),
                       file_slug(name_of(kind)), against_rays ? "rays" : "cpu", suffix),
           error_chart(study, results, scene, frame, kind, against_rays)});
    }
  }
  return charts;
}

std::vector<NamedChart> temporal_charts(const Study& study, const StudyResults& results,
                                        std::size_t scene) {
  std::vector<NamedChart> charts;
  const std::vector<FrameNumber>& frames = study.scenes[scene].frames;
  if (frames.size() < 2) return charts;
  for (const Course& course : kCourses) {
    Chart chart;
    chart.title = fmt::format("{}: {}", study.scenes[scene].name, course.label);
    chart.x_label = "frame (each method at about equal time)";
    chart.y_label = course.label;
    chart.x_scale = AxisScale::whole;
    chart.y_scale = course.scale;
    for (const std::size_t cell : equal_time_cells(study, results, scene)) {
      ChartSeries series{fmt::format("{} {}", study.method_of(cell), study.cells[cell].budget),
                         static_cast<int>(study.cells[cell].method),
                         {}};
      for (std::size_t f = 0; f < frames.size(); ++f)
        series.points.push_back(course_point(course, results, scene, cell, f, frames[f]));
      chart.series.push_back(std::move(series));
    }
    charts.push_back(
        {fmt::format("{}-frames-{}.svg", file_slug(study.scenes[scene].name), course.name), chart});
  }
  return charts;
}

std::vector<std::size_t> equal_time_cells(const Study& study, const StudyResults& results,
                                          std::size_t scene) {
  // The middle of what the scene's cells take.
  std::vector<double> times;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    if (study.cells[c].scene == scene) times.push_back(cell_cost(results.runs[c]).cpu_us);
  }
  const double target = std::max(median(times), 1e-9);

  std::vector<std::size_t> chosen;
  for (std::size_t m = 0; m < study.methods.size(); ++m) {
    std::optional<std::size_t> best;
    double best_distance = 0;
    for (std::size_t c = 0; c < study.cells.size(); ++c) {
      if (!belongs(study.cells[c], scene, m)) continue;
      const double time = std::max(cell_cost(results.runs[c]).cpu_us, 1e-9);
      const double distance = std::abs(std::log(time / target));
      if (best && distance >= best_distance) continue;
      best = c;
      best_distance = distance;
    }
    if (best) chosen.push_back(*best);
  }
  return chosen;
}

}  // namespace baton
