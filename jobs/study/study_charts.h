#pragma once

#include <string>
#include <vector>

#include "jobs/study/study_summary.h"
#include "jobs/study/svg_chart.h"

namespace baton {

/// A chart and the file that it becomes.
struct NamedChart {
  std::string file;  ///< e.g. "bunny-rmse-cpu.svg"
  Chart chart;
};

/// Error against CPU time and against rays, for each measure: over all frames when there is no
/// `frame`.
std::vector<NamedChart> error_charts(const Study& study, const StudyResults& results,
                                     std::size_t scene, FrameChoice frame);

/// What happens over the frames, at about equal time (equal_time_cells): RMSE, bias, Lns over the
/// reference's, ESS and acceptance. Empty when fewer than two frames are measured.
std::vector<NamedChart> temporal_charts(const Study& study, const StudyResults& results,
                                        std::size_t scene);

/// For each method the cell of the scene whose time is nearest to the middle one of the scene.
std::vector<std::size_t> equal_time_cells(const Study& study, const StudyResults& results,
                                          std::size_t scene);

}  // namespace baton
