#pragma once

#include <cstdint>

#include "common/job/job_spec.h"

namespace baton {

/// What a job will take, from its numbers alone: for `baton check` and for the limits of the
/// parser.
struct JobEstimate {
  std::int64_t frames = 0;
  std::int64_t tiles = 0;
  std::int64_t runs = 0;          ///< per tile
  std::int64_t render_tasks = 0;  ///< tiles * runs
  /// Tiles * frames, with correlated visibility.
  std::int64_t second_pass_tasks = 0;
  std::int64_t assemble_tasks = 0;          ///< one a frame
  std::int64_t dependencies = 0;            ///< pairs: a task waits for another
  std::int64_t rounds = 1;                  ///< those of one frame
  std::int64_t preroll_rounds = 0;          ///< before the first frame
  std::int64_t primary_rays_per_pixel = 0;  ///< in a frame; with maxSites at most
  std::int64_t shadow_rays_per_pixel = 0;   ///< at most, in a frame, in the first pass
  std::int64_t film_channels = 0;
  /// Size of one frame as float32 tiles, before compression.
  std::int64_t film_bytes = 0;
  std::int64_t frame_bytes = 0;            ///< one EXR, before compression
  std::int64_t state_bytes_per_pixel = 0;  ///< in memory; 0 when no state is carried
  std::int64_t state_bytes_per_block = 0;  ///< of PixelBlocks
  std::int64_t tile_state_bytes = 0;       ///< state of one tile in memory
  /// Size of the states of all tiles at one checkpoint, in memory.
  std::int64_t state_bytes = 0;
  std::int64_t largest_blob_bytes = 0;  ///< one tile's film or state in memory

  std::int64_t tasks() const { return render_tasks + second_pass_tasks + assemble_tasks; }
};

/// job: each value in its own range; needs no assets.
JobEstimate estimate_job(const JobSpec& job);

/// How many frames may be rendered ahead of the first that is not written: as their films have
/// room, and at least two runs, so that a tile that takes long stops nobody at once.
std::int32_t max_frames_ahead(const JobSpec& job);

}  // namespace baton
