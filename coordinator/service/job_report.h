#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "common/store/blob_store.h"
#include "coordinator/journal/journal.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/locked_frames.h"

namespace baton {

/// The frames that are finished, and others, in the job's order.
std::vector<FrameNumber> finished_frames(const Scheduler::Job& job,
                                         const std::set<FrameIndex>& besides);
/// What people are told of a job.
JobSummary summarize(const Digest& digest, const Scheduler::Job& job);
/// Describes a job that the scheduler knows. `failures`: the newest last.
JobDetail describe_job(const Scheduler& scheduler, const Digest& digest,
                       const std::vector<Failure>& failures);

/// What people are told of a job in the archive; nullopt: it is not there. name: for the error
/// (corrupt).
Result<std::optional<JobDetail>> archived_detail(Journal& journal, const Digest& job,
                                                 const std::string& name);

/// Which of the jobs that were found for a text is meant: the one of this ID, or of this name, or
/// whose ID begins so; where several are, the only one that has not ended. Returns its newest
/// version. Errors: none, or several, whose IDs it lists.
Result<Digest> choose_job(const std::vector<FoundJob>& found, const std::string& text);

/// What is not there of the files that a job's recorded completions promise: blobs that are still
/// needed, of which sizes are compared, and finished frames.
struct LostFiles {
  std::vector<TaskKey> tasks;  ///< that made them
  /// That nobody needs now (BlobLedger::spare_blobs).
  std::vector<BlobRef> spares;
  std::vector<std::string> frames;  ///< the files of finished frames among them
  std::string first;                ///< one of the files
  /// Why it cannot be told now, of a file or folder.
  std::optional<std::string> unreadable;
  std::size_t num_frames = 0;  ///< finished, lost or not
  /// Frames whose bytes must be read to tell, and frames that are others' now, or locked and gone:
  /// not lost.
  std::size_t num_unknown = 0, num_strange = 0;

  bool all_frames_right() const {
    return num_frames > 0 && frames.empty() && num_unknown == 0 && num_strange == 0 && !unreadable;
  }
};
/// restart: another picture in the place of a frame is lost, too, and a folder that is not there is
/// an empty one.
LostFiles find_lost_files(const JobAdded& job, const BlobStore& store, const FileTable& files,
                          const LockedFrames& locked, bool restart = false);
/// For people, of what is lost: empty, or lines.
std::vector<std::string> lost_reasons(const LostFiles& lost);

}  // namespace baton
