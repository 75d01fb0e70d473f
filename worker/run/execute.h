#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/sequence.h"
#include "common/job/task.h"
#include "common/store/blob_store.h"
#include "worker/run/job_cache.h"

namespace baton {

/// What a finished task hands back.
struct TaskOutput {
  std::vector<BlobRef> outputs;
  RenderStats stats;
  std::vector<FrameStats> frames = {};  ///< of a render task in frame order, of an assembly one
  /// What this machine does not see of the job, a line; then nothing was done.
  std::string unseen = {};
};

/// Runs one task, of these frames: reads its inputs from `store`, writes its outputs there (an
/// assembled frame goes to the job's output folder and is durable on return; blobs are after
/// store.sync()). Deterministic. A render task whose inputs are states of its own last frame
/// renders nothing: its state is cut and joined from them. Errors: a missing or damaged input, the
/// disk, bad input of the renderer; ErrorKind::cancelled when `stop` is requested.
Result<TaskOutput> execute_task(const LoadedJob& loaded, BlobStore& store, const TaskKey& task,
                                const std::vector<BlobRef>& inputs, const FrameSpan& frames,
                                std::stop_token stop);

}  // namespace baton
