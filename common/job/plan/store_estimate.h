#pragma once

#include <cstdint>

#include "common/job/job_spec.h"
#include "common/job/task.h"

namespace baton {

/// Bytes of blobs in the store.
struct StoreEstimate {
  /// Checkpoints that stay, and states on their way to the next frame.
  std::int64_t states = 0;
  std::int64_t films = 0;    ///< films of frames not written yet
  std::int64_t samples = 0;  ///< what the second pass reads

  std::int64_t total() const { return states + films + samples; }
};

/// What is in the store of a job at its fullest with one worker, as it is likely: sizes are those
/// that docs/lab/store.md measures. surface_share: of the pixels that see a surface, [0, 1].
StoreEstimate estimate_store(const JobSpec& job, double surface_share);

/// What is in it at most, however many workers there are and however badly blobs pack.
StoreEstimate bound_store(const JobSpec& job);

/// How many states of each tile stay in the store between runs, but for those that workers read of
/// each other in motion; 0 where none are carried.
std::int64_t num_state_sets(const JobSpec& job);
/// Frames whose films stay for another sweep, of this job or a later one.
std::int64_t num_films_that_stay(const JobSpec& job);

/// What a blob of a whole tile takes, as it is likely; all pixels see a surface.
std::int64_t estimate_blob_bytes(const JobSpec& job, BlobKind kind);

}  // namespace baton
