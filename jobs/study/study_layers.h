#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/job/job_spec.h"
#include "jobs/study/study_reader.h"

namespace baton {

/// A patch of a study and where the study says it.
struct StudyPatch {
  std::string path;      ///< JSON path in the study
  nlohmann::json value;  ///< merged into the job [RFC 7396]
};

/// The job that comes of `base` (a job in canonical JSON) when the patches are merged into it one
/// after another. Faults are reported at the last patch that says the faulty value, or at
/// `base_path`. nullopt when there are any.
std::optional<JobSpec> patched_job(const nlohmann::json& base, const std::string& base_path,
                                   const std::vector<StudyPatch>& patches,
                                   const std::filesystem::path& base_directory,
                                   StudyFaults& faults);

}  // namespace baton
