#pragma once

#include <cstdint>
#include <memory>

#include "common/base/machine_memory.h"
#include "common/base/memory_share.h"
#include "common/image/pixel_limit.h"

namespace baton {

/// What a process may use of its machine's memory, shared out in sixteenths. What does not fit into
/// a share is read or made again; a scene that does not fit is refused.
struct MemoryBudget {
  std::uint64_t total_bytes = 0;
  /// A job's scene, with the tiles and frames in work.
  std::uint64_t scene_bytes = 0;
  /// Environment maps as they were read, for all jobs.
  MemorySharePtr maps;
  MemorySharePtr light;  ///< mixed maps and presampled light
  /// Where things move: what primary rays have seen, and the geometry of what deforms.
  MemorySharePtr surfaces;
  MemorySharePtr states;  ///< decoded sample states

  static MemoryBudget of(std::uint64_t total_bytes) {
    const auto share = [total_bytes](std::uint64_t sixteenths) {
      return std::make_shared<MemoryShare>(total_bytes / 16 * sixteenths);
    };
    return {.total_bytes = total_bytes,
            .scene_bytes = total_bytes / 16 * 7,
            .maps = share(2),
            .light = share(1),
            .surfaces = share(2),
            .states = share(4)};
  }
  /// Maps and plates, which are read whole: what a decoder, its colours and a map that is mixed
  /// take of each pixel, as measured with a Radiance map of 16384 x 8192.
  PixelLimit pictures() const {
    return PixelLimit::in_memory(total_bytes, 44, "the worker's (--memory)");
  }
  static MemoryBudget of_machine() { return of(default_memory_bytes()); }
};

}  // namespace baton
