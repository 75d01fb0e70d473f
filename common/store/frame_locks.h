#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/base/result.h"

namespace baton {

/// Coordinators do not know each other's journals: which frames of an output folder are locked, and
/// by which jobs, stands in the folder, too. Each job has a file of its own in this folder, under
/// its ID, with the names of its frames' files, a line each; so no coordinator ever changes what
/// another one has written.
std::filesystem::path lock_folder(const std::filesystem::path& folder);

/// Replaces what the folder says of a job, which is named by its ID; without anything to say its
/// file goes, and with the last one lock_folder(). Errors, io: the disk; there is something to say,
/// and `folder` is not there.
Status record_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files);

/// Forgets what the folder says of a job but these. Errors as above.
Status retain_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files);

/// Names of the files that are locked by other jobs than `job`, and by which. Errors, io: that
/// cannot be read now.
Result<std::map<std::string, std::string>> locks_of_others(const std::filesystem::path& folder,
                                                           const std::string& job);

}  // namespace baton
