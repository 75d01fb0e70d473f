#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// A pixel of the image, (0, 0) is the upper left one.
struct PixelPosition {
  int x = 0;
  int y = 0;
};

struct ReplayOptions {
  std::filesystem::path job;           ///< a job file
  int frame_number = 1;                ///< the user's number
  int tile = 0;                        ///< 0-based
  std::optional<PixelPosition> pixel;  ///< prints everything about this pixel
  /// EXR of the tile; empty: "tile<T>.frame<F>.exr".
  std::filesystem::path out;
};

/// Renders one tile up to the frame in this process, without a farm: with carried state from the
/// first frame on, otherwise the frame alone. The pixels are those that the farm makes. Writes the
/// tile as EXR; returns the report for stdout. Errors: those of the job, a frame or tile that it
/// does not have, a pixel outside the tile.
Result<std::string> replay_tile(const ReplayOptions& options);

/// The command line that replays the tile.
std::string replay_command(const std::filesystem::path& job, FrameNumber frame, int tile);

}  // namespace baton
