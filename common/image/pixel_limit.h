#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <string>

#include "common/base/result.h"

namespace baton {

/// How large a picture may be that is read, by its header, before memory is taken for it.
struct PixelLimit {
  std::int64_t most = std::numeric_limits<std::int64_t>::max();
  std::string why{};  ///< behind "at most N million pixels"

  /// What fits into so many bytes. whose: "the worker's" memory.
  static PixelLimit in_memory(std::uint64_t bytes, std::uint64_t bytes_per_pixel,
                              const std::string& whose) {
    return {static_cast<std::int64_t>(bytes / bytes_per_pixel),
            fmt::format(", {} bytes each, of {} {} MiB", bytes_per_pixel, whose, bytes >> 20)};
  }

  /// Error (bad_input): it is larger. name: goes first.
  Status check(std::int64_t width, std::int64_t height, const std::string& name) const {
    if (width * height <= most) return {};
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: {} x {} pixels, expected at most {:.1f} million{}", name, width,
                             height, 1e-6 * static_cast<double>(most), why)};
  }
};

}  // namespace baton
