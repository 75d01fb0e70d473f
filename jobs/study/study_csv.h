#pragma once

#include <string>
#include <vector>

#include "jobs/study/study_summary.h"

namespace baton {

/// One line per rendering and measured frame: errors, counted work and the sampler's numbers. Has
/// no time, so it is the same for any machine of one instruction set, any stop and resume.
std::string measurements_csv(const Study& study, const StudyResults& results);

/// One line per rendering: CPU seconds of the stages and bytes of state.
std::string costs_csv(const Study& study, const StudyResults& results);

/// One line per scene and measured frame: what the reference can resolve.
std::string references_csv(const Study& study, const StudyResults& results);

/// One line per cell: costs, errors with intervals, efficiencies. rows: summarize_study.
std::string efficiency_csv(const Study& study, const std::vector<CellSummary>& rows);

}  // namespace baton
