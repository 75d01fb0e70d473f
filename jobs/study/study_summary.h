#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/study/intervals.h"
#include "jobs/study/study_runner.h"

namespace baton {

/// How errors are measured in charts.
enum class ErrorKindOfImage : std::uint8_t { rmse, shown, rel_mse, flip };
inline constexpr ErrorKindOfImage kImageErrors[] = {ErrorKindOfImage::rmse, ErrorKindOfImage::shown,
                                                    ErrorKindOfImage::rel_mse,
                                                    ErrorKindOfImage::flip};
const char* name_of(ErrorKindOfImage kind);

/// What a rendering of a cell costs: middle of its renderings, per pixel with a surface and frame.
struct CellCost {
  /// Primary rays, sampling, visibility, shading, second pass.
  double cpu_us = 0;
  double rays = 0;         ///< shadow rays of both passes
  double evaluations = 0;  ///< evaluations of the target
  /// Preparing the light, per frame, whatever the number of pixels.
  double light_ms = 0;
  double state_bytes = 0;
};
CellCost cell_cost(const std::vector<RunRecord>& runs);

/// Frames of a scene: one by position, or all.
using FrameChoice = std::optional<std::size_t>;

/// The error of a cell over its renderings. All frames: the mean over frames of squared error or
/// FLIP.
Interval cell_error(const std::vector<RunRecord>& runs, ErrorKindOfImage kind, FrameChoice frame);

/// What the references of a scene cannot resolve, in the same measure.
double reference_error(const std::vector<Reference>& references, ErrorKindOfImage kind,
                       FrameChoice frame);

/// MSE x time of cell `base` over that of `cell`, over all frames: how much more efficient `cell`
/// is, by a squared error: in linear radiance or as shown. NaN when it took no time.
Interval efficiency_ratio(const StudyResults& results, std::size_t base, std::size_t cell,
                          ErrorKindOfImage kind = ErrorKindOfImage::rmse);

/// Positions of the points that no other one beats in both: not slower and smaller. Equal points
/// count once. costs, errors: of one length.
std::vector<bool> pareto_front(const std::vector<double>& costs, const std::vector<double>& errors);

/// Measured frames from the cut on until the squared error has come down to 1.5 times what it stays
/// at, its median over the later half of them. 0: at once. NaN without a cut.
double lag_after_cut(const StudyScene& scene, const std::vector<RunRecord>& runs);

/// One row of the table of efficiencies.
struct CellSummary {
  std::size_t cell = 0;
  CellCost cost;
  Interval rmse, shown, rel_mse, flip, bias;
  double percentile_99_9 = 0;
  /// As shown: RMSE of the darkest quarter and of the worst square, 99.9th percentile, share of
  /// black specks; means over frames and renderings.
  double shown_darkest = 0, shown_worst_block = 0, shown_percentile = 0, black = 0;
  /// Over renderings; NaN when no two measured frames follow each other.
  Interval flicker;
  double lag = 0;  ///< lag_after_cut; NaN without a cut
  /// The squared error is at least that of the reference.
  bool resolved = false;
  /// The interval of the bias, with the reference's, leaves out 0.
  bool biased = false;
  /// MSE x time of the baseline over MSE x time of this cell: > 1 is better. The baseline has the
  /// budget of the same name, or is the best of its method. NaN without the method in the study.
  Interval against_mis, against_bidirectional;
  /// The same by the error as shown.
  Interval shown_against_mis, shown_against_bidirectional;
};
std::vector<CellSummary> summarize_study(const Study& study, const StudyResults& results);

}  // namespace baton
