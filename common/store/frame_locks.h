#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/base/result.h"

namespace baton {

/// Coordinators do not know each other's journals: which frames of an output folder are locked, and
/// by which jobs, stands in the folder, too, in this file: a line for each, the job's ID, a blank
/// and the name of the frame's file.
std::filesystem::path lock_file(const std::filesystem::path& folder);

/// Replaces what the folder's file says of a job, which is named by its ID; without anything to say
/// the file goes. Errors: the disk; corrupt, the file is none of ours, and stays as it is.
Status record_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files);

/// Forgets what the folder's file says of a job but these. Errors as above.
Status retain_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files);

/// Names of the files that are locked by other jobs than `job`, and by which. Errors as above.
Result<std::map<std::string, std::string>> locks_of_others(const std::filesystem::path& folder,
                                                           const std::string& job);

}  // namespace baton
