#pragma once

#include <algorithm>
#include <filesystem>

namespace baton {

/// Whether a path lies in a folder, or is it. Both without links and dots.
inline bool lies_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace baton
