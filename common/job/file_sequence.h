#pragma once

#include <cstdint>
#include <string>

#include "common/base/limits.h"
#include "common/job/time.h"

namespace baton {

/// Which of numbered files stands for those before the first and after the last.
enum class FilesBeyond : std::uint8_t { hold, loop };

/// Files with a number in their name, one for each frame of a job; or one file for all.
struct FileSequence {
  /// Absolute path; '#'s are the zero-padded number, none: the same file always.
  std::string files{};
  double speed = 1;                               ///< numbers a frame, [-1e6, 1e6]
  int offset = 0;                                 ///< added to frame times speed
  int first = 0, last = limits::kMaxFrameNumber;  ///< numbers that there are
  FilesBeyond beyond = FilesBeyond::hold;

  bool operator==(const FileSequence&) const = default;
  bool is_numbered() const { return files.find('#') != std::string::npos; }
};

/// "frame.####.exr" with number 7 -> "frame.0007.exr". A pattern without '#' is returned unchanged.
std::string frame_file_name(const std::string& pattern, int number);

/// The number of the file at a frame of the job: floor(speed frame) + offset, brought between
/// `first` and `last`.
int number_at(const FileSequence& sequence, FrameNumber frame);
/// Its path.
std::string file_at(const FileSequence& sequence, FrameNumber frame);

}  // namespace baton
