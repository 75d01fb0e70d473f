#pragma once

#include <string>
#include <vector>

#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/file_reader.h"
#include "coordinator/service/folder_record.h"

namespace baton {

/// Before a job is done, its frames are compared with what was recorded at their reports: size,
/// inode and time, the bytes where these differ.

/// The files of all finished frames that are not locked.
std::vector<FileToRead> files_to_inspect(const Scheduler::Job& job, const FileTable& files,
                                         const LockedFrames& locked);

/// How the finished frames of a job stand.
struct InspectedFrames {
  std::vector<TaskKey> lost;            ///< gone or damaged
  std::vector<std::string> lost_files;  ///< theirs, in that order
  FramesInDoubt doubt;
  /// Why one of them cannot be read; empty: none is.
  std::string unreadable;
  /// Whether a frame has changed since it was read, or was not among those that were.
  bool is_stale = false;

  bool all_right() const {
    return lost.empty() && doubt.empty() && unreadable.empty() && !is_stale;
  }
};
/// contents: of files_to_inspect(), maybe of an earlier day of the job. version: the job's. Errors:
/// the journal's.
Result<InspectedFrames> inspect_frames(const Scheduler::Job& job,
                                       const std::vector<FileContent>& contents,
                                       const LockedFrames& locked, Journal& journal,
                                       const IdentityBook& jobs, const Digest& version);

}  // namespace baton
