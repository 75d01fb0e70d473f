#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/base/result.h"

namespace baton {

/// How a file stands in its folder; one that was written again differs in some of it.
struct FileStamp {
  std::uint64_t size_bytes = 0, inode = 0;
  /// Of the last change of the bytes, or of how the file is kept: the former alone can be set back.
  std::int64_t time_ns = 0;

  bool operator==(const FileStamp&) const = default;
};

/// nullopt: nothing has this name. Errors name the file: bad_input, it is a folder, no plain
/// file or a link that leads nowhere; io, it cannot be looked at now.
Result<std::optional<FileStamp>> stamp_of(const std::filesystem::path& path);

}  // namespace baton
