#include "jobs/study/study_summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// Two-sided 95 % of a normal distribution.
constexpr double kNormal95 = 1.96;
/// Squared error over the final one at which a cut counts as overcome.
constexpr double kOvercome = 1.5;

/// What there is of an error in frames and in references.
struct ErrorRow {
  const char* name;
  bool is_squared;  ///< its root is told
  double (*measured)(const FrameMeasures&);
  double (*own)(const Reference&);
};
const ErrorRow& row_of(ErrorKindOfImage kind) {
  using F = FrameMeasures;
  using R = Reference;
  static constexpr std::array<ErrorRow, 4> kRows{
      {{"RMSE", true, [](const F& m) { return m.mse; }, [](const R& r) { return r.mse; }},
       {"RMSE as shown", true, [](const F& m) { return m.shown.mse; },
        [](const R& r) { return r.shown.own_mse(); }},
       {"relMSE", false, [](const F& m) { return m.rel_mse; },
        [](const R& r) { return r.rel_mse; }},
       {"FLIP", false, [](const F& m) { return m.flip; }, [](const R& r) { return r.flip; }}}};
  return kRows.at(static_cast<std::size_t>(kind));
}

/// One number a rendering: a measure at a frame, or its mean over those frames that have it.
template <class F>
std::vector<double> per_run(const std::vector<RunRecord>& runs, FrameChoice frame, F measure) {
  std::vector<double> values;
  for (const RunRecord& run : runs) {
    double sum = 0;
    int count = 0;
    for (std::size_t f = 0; f < run.frames.size(); ++f) {
      const double value = measure(run.frames[f]);
      if ((frame && *frame != f) || std::isnan(value)) continue;
      sum += value;
      ++count;
    }
    if (count > 0) values.push_back(sum / count);
  }
  return values;
}

std::vector<double> squared_errors(const std::vector<RunRecord>& runs, ErrorKindOfImage kind) {
  BATON_CHECK(row_of(kind).is_squared);
  return per_run(runs, {}, row_of(kind).measured);
}

double safe_root(double squared) { return std::sqrt(std::max(squared, 0.0)); }

Interval root(Interval squared) {
  return {safe_root(squared.low), safe_root(squared.value), safe_root(squared.high)};
}

/// Standard error of the references' mean radiance over all frames: their pixels are independent.
double standard_error(const std::vector<Reference>& references) {
  double variance = 0;
  for (const Reference& r : references)
    variance += r.mse / static_cast<double>(std::max<std::size_t>(r.lit_pixels.size(), 1));
  return std::sqrt(variance) / static_cast<double>(references.size());
}

/// The cell that `cell` is compared with: same scene, the method, the budget of the same name or
/// the most efficient one.
std::optional<std::size_t> baseline(const Study& study, const StudyResults& results,
                                    std::size_t cell, Method method) {
  std::optional<std::size_t> best;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const StudyCell& other = study.cells[c];
    if (other.scene != study.cells[cell].scene || other.job.sampling.method != method) continue;
    if (other.budget == study.cells[cell].budget) return c;
    if (!best || efficiency_ratio(results, *best, c).value > 1) best = c;
  }
  return best;
}

CellSummary summarize_cell(const Study& study, const StudyResults& results, std::size_t cell) {
  const std::vector<RunRecord>& runs = results.runs[cell];
  const std::vector<Reference>& references = results.references[study.cells[cell].scene];
  CellSummary row;
  row.cell = cell;
  row.cost = cell_cost(runs);
  row.rmse = cell_error(runs, ErrorKindOfImage::rmse, {});
  row.shown = cell_error(runs, ErrorKindOfImage::shown, {});
  row.rel_mse = cell_error(runs, ErrorKindOfImage::rel_mse, {});
  row.flip = cell_error(runs, ErrorKindOfImage::flip, {});
  const auto tails = per_run(runs, {}, [](const FrameMeasures& m) { return m.percentile_99_9; });
  row.percentile_99_9 = mean_interval(tails).value;
  const auto mean = [&](auto measure) { return mean_interval(per_run(runs, {}, measure)).value; };
  using M = FrameMeasures;
  row.shown_darkest = safe_root(mean([](const M& m) { return m.shown.darkest_mse; }));
  row.shown_worst_block = safe_root(mean([](const M& m) { return m.shown.worst_block_mse; }));
  row.shown_percentile = mean([](const M& m) { return m.shown.percentile_99_9; });
  row.black = mean([](const M& m) { return m.shown.black; });
  const auto flicker = per_run(runs, {}, [](const FrameMeasures& m) { return m.flicker; });
  row.flicker = flicker.empty() ? Interval{kNone, kNone, kNone} : mean_interval(flicker);
  row.lag = lag_after_cut(study.scene_of(cell), runs);
  row.resolved = row.rmse.value >= reference_error(references, ErrorKindOfImage::rmse, {});

  // The reference's own uncertainty widens the interval of the bias.
  row.bias = mean_interval(per_run(runs, {}, [](const FrameMeasures& m) { return m.bias; }));
  const double extra = kNormal95 * standard_error(references);
  row.bias.low = row.bias.value - std::hypot(row.bias.value - row.bias.low, extra);
  row.bias.high = row.bias.value + std::hypot(row.bias.high - row.bias.value, extra);
  row.biased = row.bias.low > 0 || row.bias.high < 0;

  const auto against = [&](Method method, ErrorKindOfImage kind) {
    const auto base = baseline(study, results, cell, method);
    return base ? efficiency_ratio(results, *base, cell, kind) : Interval{kNone, kNone, kNone};
  };
  row.against_mis = against(Method::mis, ErrorKindOfImage::rmse);
  row.against_bidirectional = against(Method::bidirectional, ErrorKindOfImage::rmse);
  row.shown_against_mis = against(Method::mis, ErrorKindOfImage::shown);
  row.shown_against_bidirectional = against(Method::bidirectional, ErrorKindOfImage::shown);
  return row;
}

}  // namespace

const char* name_of(ErrorKindOfImage kind) { return row_of(kind).name; }

CellCost cell_cost(const std::vector<RunRecord>& runs) {
  std::vector<double> cpu, rays, evaluations, light, state;
  for (const RunRecord& run : runs) {
    const RunCounts& s = run.counts;
    const auto lit = static_cast<double>(s.lit_pixels());
    if (!(lit > 0)) continue;
    cpu.push_back(1e6 / lit *
                  (s.seconds_primary + s.seconds_sample + s.seconds_visibility + s.seconds_shade +
                   s.seconds_second_pass));
    rays.push_back(static_cast<double>(s.rays_shadow) / lit);
    evaluations.push_back(static_cast<double>(s.target_evaluations) / lit);
    light.push_back(1e3 * s.seconds_light / static_cast<double>(run.frames_rendered));
    state.push_back(run.state_pixels > 0 ? static_cast<double>(run.state_bytes) /
                                               static_cast<double>(run.state_pixels)
                                         : 0);
  }
  return {median(cpu), median(rays), median(evaluations), median(light), median(state)};
}

Interval cell_error(const std::vector<RunRecord>& runs, ErrorKindOfImage kind, FrameChoice frame) {
  const Interval mean = mean_interval(per_run(runs, frame, row_of(kind).measured));
  return row_of(kind).is_squared ? root(mean) : mean;
}

double reference_error(const std::vector<Reference>& references, ErrorKindOfImage kind,
                       FrameChoice frame) {
  double sum = 0, count = 0;
  for (std::size_t f = 0; f < references.size(); ++f) {
    if (frame && *frame != f) continue;
    sum += row_of(kind).own(references[f]);
    count += 1;
  }
  const double mean = count > 0 ? sum / count : 0;
  return row_of(kind).is_squared ? std::sqrt(mean) : mean;
}

Interval efficiency_ratio(const StudyResults& results, std::size_t base, std::size_t cell,
                          ErrorKindOfImage kind) {
  const double time = cell_cost(results.runs[cell]).cpu_us;
  const double factor = time > 0 ? cell_cost(results.runs[base]).cpu_us / time : kNone;
  const Interval ratio = ratio_interval(squared_errors(results.runs[base], kind),
                                        squared_errors(results.runs[cell], kind));
  return {ratio.low * factor, ratio.value * factor, ratio.high * factor};
}

std::vector<bool> pareto_front(const std::vector<double>& costs,
                               const std::vector<double>& errors) {
  // Cheapest first, then every one that is better than all cheaper ones.
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(costs[a], errors[a]) < std::pair(costs[b], errors[b]);
  });
  std::vector<bool> front(costs.size(), false);
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (!(errors[i] < best)) continue;
    best = errors[i];
    front[i] = true;
  }
  return front;
}

double lag_after_cut(const StudyScene& scene, const std::vector<RunRecord>& runs) {
  std::vector<double> errors;
  for (std::size_t f = 0; f < scene.frames.size(); ++f) {
    if (scene.cut_frame == FrameNumber(0) || scene.frames[f] < scene.cut_frame) continue;
    const auto values = per_run(runs, f, [](const FrameMeasures& m) { return m.mse; });
    errors.push_back(mean_interval(values).value);
  }
  if (errors.empty()) return kNone;
  const double settled = median(std::span(errors).subspan(errors.size() / 2));
  const auto overcome = std::find_if(errors.begin(), errors.end(),
                                     [&](double error) { return error <= kOvercome * settled; });
  return static_cast<double>(overcome - errors.begin());
}

std::vector<CellSummary> summarize_study(const Study& study, const StudyResults& results) {
  std::vector<CellSummary> rows;
  for (std::size_t c = 0; c < study.cells.size(); ++c)
    rows.push_back(summarize_cell(study, results, c));
  return rows;
}

}  // namespace baton
