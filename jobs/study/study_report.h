#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "jobs/study/study_charts.h"

namespace baton {

/// Writes everything that a study shows into a folder: measurements.csv, costs.csv, references.csv,
/// efficiency.csv, the charts as SVG, the crops as PNG, and report.html, which contains them all
/// and needs no other file. machine: named in the report. Returns the report's path. Errors: the
/// disk; frames of seed 1 that are gone.
Result<std::filesystem::path> write_report(const Study& study, const StudyResults& results,
                                           const StudyFolder& folder,
                                           const std::filesystem::path& output,
                                           const std::string& machine);

}  // namespace baton
