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
std::optional<Digest> find_missing_blob(const FarmCore& farm, const TaskDone& report);
/// How the frame of a task that is not done stands where it belongs.
struct ReportedFrame {
  std::filesystem::path path;
  Digest digest;                           ///< as reported
  Result<std::optional<FileStamp>> stamp;  ///< nullopt: not there, or with another size
  /// As the worker saw it when it had these bytes.
  bool is_as_written = false;
};
/// nullopt: no such frame is reported.
std::optional<ReportedFrame> find_reported_frame(const FarmCore& farm, const TaskDone& report);
/// What a task of an open job lacks to write what it makes, whoever does it.
struct Hindrance {
  /// For people, such as "a folder that can be written: /frames".
  std::string lacks;
  /// Something stands in the frame's place that is no file or cannot be read: waiting does not make
  /// it go, as it does a full disk.
  bool stays = false;
};
/// nullopt: nothing that can be seen from here.
std::optional<Hindrance> find_hindrance(const FarmCore& farm, const LeaseId& lease);
/// The task waits for what it lacks: nobody's failure. What stays pauses its job the second time:
/// the first may be an error of the moment. why: what the worker said.
Status wait_for_disk(FarmCore& farm, const std::string& worker, const LeaseId& lease,
                     const Hindrance& hindrance, const std::string& why);
/// The inputs of a leased task that must be read to tell whether they are damaged.
std::vector<FileToRead> unread_inputs(const FarmCore& farm, const FileTable& files,
                                      const LeaseId& lease);
/// The inputs of a leased task that are gone, damaged or cannot be read; none of them where a task
/// that makes them is being done again meanwhile. nullopt: the inputs are sound, or the disk cannot
/// tell now.
std::optional<std::vector<BlobRef>> find_bad_inputs(const FarmCore& farm, FileTable& files,
                                                    const LeaseId& lease);

}  // namespace baton
