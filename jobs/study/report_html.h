#pragma once

#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "jobs/study/study_summary.h"

namespace baton {

struct ReportCrops {
  std::vector<std::size_t> cells;  ///< from left to right, after the reference
  Bytes png;
};

/// What the report shows of a scene; charts as SVG.
struct ReportScene {
  std::vector<std::string> overview, courses, frames;
  ReportCrops crops;
};

/// One page that needs no other file. rows: summarize_study.
std::string report_html(const Study& study, const StudyResults& results,
                        const std::vector<CellSummary>& rows,
                        const std::vector<ReportScene>& scenes, const std::string& machine);

}  // namespace baton
