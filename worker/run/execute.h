#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/file_stamp.h"
#include "common/base/result.h"
#include "common/job/plan/sequence.h"
#include "common/job/task.h"
#include "common/store/blob_store.h"
#include "worker/run/frame_place.h"
#include "worker/run/job_cache.h"

namespace baton {

/// What a finished task hands back.
struct TaskResult {
  TaskOutput made;
  /// How the file of an assembled frame stood when it was written; zero: that is not known.
  FileStamp frame = {};
  /// What this machine does not see of the job, a line; then nothing was done.
  std::string unseen = {};
  /// Held inputs that are not here; then nothing was done.
  std::vector<BlobRef> not_held = {};
  /// A picture that stands in the frame's place and stays; then the frame was not written.
  std::optional<PictureInPlace> in_place = {};
  /// About files, for people: what was repaired, what is odd.
  std::vector<std::string> notes = {};
};

/// How a task that was leased has ended.
struct TaskEnded {
  LeaseId lease;
  Result<TaskResult> result;
  std::vector<BlobRef> left = {};  ///< in the store, by one that has no result
};

/// Executes one task, of the grant's frames: reads its inputs from `store`, writes its outputs
/// there (an assembled frame goes to the job's output folder and is durable on return; blobs are
/// after store.sync()). A state that may be held stays in loaded.held if there is room.
/// Deterministic. With an empty span of steps a render task's state is cut and joined from its
/// inputs. Errors: a missing or damaged input, the disk, bad input of the renderer;
/// ErrorKind::cancelled when `stop` is requested. After one, `left` is what had been put into the
/// store. An assembly is shared with who is lent.
Result<TaskResult> execute_task(const LoadedJob& loaded, BlobStore& store, const Grant& grant,
                                const std::stop_token& stop, std::vector<BlobRef>* left = nullptr,
                                const Lend& lend = lend_nobody);

/// Packs held states of a job into the store. Errors: the disk.
Result<std::vector<PublishedState>> publish_held(const JobStates::List& states, BlobStore& store);

}  // namespace baton
