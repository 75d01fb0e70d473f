#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "common/base/limits.h"
#include "worker/pass/primary.h"

namespace baton {

/// What the tiles of this process saw last, where things move: the next frame asks for it again,
/// and tracing it a second time is the same work with the same result. Holds the last frames, of at
/// most `max_bytes` in all; the oldest go first. Any number of threads.
class SurfaceCache {
 public:
  explicit SurfaceCache(std::size_t max_bytes = limits::kMaxSurfaceCacheBytes)
      : max_bytes_(max_bytes) {}

  /// Null: not here.
  std::shared_ptr<const TileSurfaces> find(std::int32_t frame_index, std::int32_t tile);
  void insert(std::int32_t frame_index, std::int32_t tile,
              std::shared_ptr<const TileSurfaces> surfaces);

 private:
  using Key = std::pair<std::int32_t, std::int32_t>;  ///< (frame index, tile)

  const std::size_t max_bytes_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<const TileSurfaces>> surfaces_;
  std::deque<Key> by_age_;  ///< oldest in front
  std::size_t size_bytes_ = 0;
};

}  // namespace baton
