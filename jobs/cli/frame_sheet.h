#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"
#include "jobs/cli/display.h"

namespace baton {

/// A frame small enough for a sheet. Errors: read_rgb_image's.
Result<RgbImage> read_thumbnail(const std::filesystem::path& path);

/// Writes linear thumbnails in reading order with their frame numbers, all as a viewer shows them
/// (display_radiance). Errors: the disk.
Status write_sheet(const std::filesystem::path& path, std::vector<RgbImage> thumbnails,
                   const std::vector<FrameNumber>& numbers, int columns,
                   const DisplayOptions& display);

/// contact-sheet.png of a job: at most 12 of its frames, evenly picked, all at one exposure. Frames
/// are read as they are finished, so that little is left to do in the end.
class FrameSheet {
 public:
  explicit FrameSheet(const JobSpec& job);

  /// Reads those of the finished frames that belong on the sheet and are new. A frame that cannot
  /// be read is the error of write().
  void add(const std::vector<FrameNumber>& finished);

  /// Writes what there is into the output folder; no sheet without a frame.
  Result<std::optional<std::filesystem::path>> write(const DisplayOptions& display) const;

 private:
  OutputSpec output_;
  std::vector<FrameNumber> wanted_;             ///< ascending
  std::map<FrameNumber, RgbImage> thumbnails_;  ///< linear RGB, by frame number
  Status read_;
};

}  // namespace baton
