#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/time.h"

namespace baton {

/// A frame of a sequence on disk.
struct NumberedFrame {
  FrameNumber number{};
  std::filesystem::path file;
};

/// Frames of a sequence, some of which need not be there.
struct FrameFolder {
  std::filesystem::path directory;
  /// Those that are there; ascending, at least one.
  std::vector<NumberedFrame> frames;
  std::vector<FrameNumber> missing;  ///< ascending
  std::string frames_per_second;     ///< a number, "24" or "24000/1001"
};

/// What is there of the frames of a job file, or of a folder with numbered EXR files
/// (`shot.####.exr`, of one name). range: only these frames, "1-48"; empty: those of the job, or
/// all in the folder. Errors: a job that cannot be read, a folder with frames of two names, a bad
/// range, no frame.
Result<FrameFolder> find_frames(const std::filesystem::path& job_or_folder,
                                const std::string& range);

}  // namespace baton
