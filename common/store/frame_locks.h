#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/base/files.h"
#include "common/base/result.h"

namespace baton {

/// Coordinators do not know each other's journals: which frames of an output folder are locked, and
/// by which jobs, stands in the folder, too. Each job has a file of its own in this folder, under
/// its ID, with `#` and the time of the last change, and the names of its frames' files, a line
/// each; so no coordinator ever changes what another one has written.
std::filesystem::path lock_folder(const std::filesystem::path& folder);

/// What a folder says of one job.
struct FolderLocks {
  std::set<std::string> files = {};  ///< names of those that are locked
  /// When one was last locked or unlocked, milliseconds by UTC; 0: by a program that did not say.
  std::int64_t changed_ms = 0;

  bool operator==(const FolderLocks&) const = default;
};

/// Replaces what the folder says of a job, which is named by its ID; without files its own goes,
/// and with the last one lock_folder(). Errors, io: the disk; there is something to say, and
/// `folder` is not there; bad_input: it is in none of `roots`.
Status record_locks(const std::filesystem::path& folder, const std::string& job,
                    const FolderLocks& locks, const Roots& roots = {});

/// Forgets what the folder says of a job but these; the time stays. Errors as above.
Status retain_locks(const std::filesystem::path& folder, const std::string& job,
                    const std::set<std::string>& files, const Roots& roots = {});

/// By the jobs' IDs. Errors, io: that cannot be read now.
Result<std::map<std::string, FolderLocks>> locks_by_job(const std::filesystem::path& folder);

/// Names of the files that are locked by other jobs than `job`, and by which. Errors as above.
Result<std::map<std::string, std::string>> locks_of_others(const std::filesystem::path& folder,
                                                           const std::string& job);

}  // namespace baton
