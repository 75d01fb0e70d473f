#pragma once

#include <string>

#include "common/base/trace.h"
#include "common/job/task.h"
#include "worker/run/job_cache.h"

namespace baton {

/// What traces say of a task, as members of a JSON object: "job", the digest of its version in
/// hexadecimal digits, "kind", "position" and "tile" (TaskKey).
std::string traced_task(const LeaseId& lease);

/// The span of a task on its thread, with what one needs to play the job again: traced_task(),
/// "attempt", of a render task "first" and "last", the steps that it renders, and "inputs", of
/// which each is [kind, position, tile] (BlobRef). Those of an assembly are the films of "step".
class TaskSpan {
 public:
  explicit TaskSpan(const Grant& grant);

  /// Says which frames these are, and whose: "id" is that of the job.
  void name(const LoadedJob& loaded, const Grant& grant);
  /// Of a task that has made nothing "lost" says why.
  void end(const Result<TaskResult>& result);

 private:
  Span span_;
};

}  // namespace baton
