#pragma once

#include <filesystem>
#include <map>

#include "common/job/task.h"

namespace baton {

/// What the files of output folders hold. Each is read once, and again when its size or time has
/// changed: a client that does not wait for a long look asks again.
class FrameFiles {
 public:
  /// Whether the file has the size and digest that were recorded when it was written. Reads it only
  /// if the size is right.
  bool holds(const std::filesystem::path& path, const BlobRef& image);

 private:
  struct Content {
    std::uint64_t size_bytes = 0;
    std::filesystem::file_time_type time;
    Digest digest;
  };
  std::map<std::filesystem::path, Content> files_;  ///< at most limits::kMaxFrames
};

}  // namespace baton
