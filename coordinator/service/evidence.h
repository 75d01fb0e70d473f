#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/service/farm_core.h"
#include "coordinator/service/file_table.h"

namespace baton {

/// What the disk says beside a worker's report. A report of a task that is done needs none: its
/// blobs may have served their purpose.

/// A film or state that is reported and not in the store; nullopt: there is none.
std::optional<std::string> find_missing_blob(const FarmCore& farm, const TaskDone& report);
/// A frame that is reported and not where it belongs, with its size; nullopt: there is none.
std::optional<std::string> find_missing_frame(const FarmCore& farm, const TaskDone& report);
/// Whether the file system that a task of an open job writes to is mounted read-only.
bool writes_nowhere(const FarmCore& farm, const LeaseId& lease);
/// The inputs of a leased task that must be read to tell whether they are damaged.
std::vector<std::filesystem::path> unread_inputs(const FarmCore& farm, const FileTable& files,
                                                 const LeaseId& lease);
/// The inputs of a leased task that are gone or damaged; none of them where a task that makes them
/// is being done again meanwhile. nullopt: the inputs are sound, or the disk cannot tell now.
std::optional<std::vector<BlobRef>> find_bad_inputs(const FarmCore& farm, FileTable& files,
                                                    const LeaseId& lease);

}  // namespace baton
