#include "worker/pass/surface_cache.h"

namespace baton {
namespace {

/// Tiles are so many frames apart at most, as a rule.
constexpr std::int32_t kFramesKept = 4;

std::size_t size_bytes(const TileSurfaces& surfaces) {
  return surfaces.hits.size() * (sizeof(SurfaceHit) + sizeof(Ray)) + surfaces.first_site.size();
}

}  // namespace

std::shared_ptr<const TileSurfaces> SurfaceCache::find(std::int32_t frame_index,
                                                       std::int32_t tile) {
  const std::lock_guard lock(mutex_);
  const auto found = surfaces_.find({frame_index, tile});
  return found != surfaces_.end() ? found->second : nullptr;
}

void SurfaceCache::insert(std::int32_t frame_index, std::int32_t tile,
                          std::shared_ptr<const TileSurfaces> surfaces) {
  const std::lock_guard lock(mutex_);
  const std::size_t added = size_bytes(*surfaces);
  if (!surfaces_.try_emplace({frame_index, tile}, std::move(surfaces)).second) return;
  by_age_.emplace_back(frame_index, tile);
  size_bytes_ += added;

  // Make room; whoever still reads a tile keeps it alive.
  while (size_bytes_ > max_bytes_ ||
         (!by_age_.empty() && by_age_.front().first + kFramesKept <= frame_index)) {
    const auto oldest = surfaces_.find(by_age_.front());
    size_bytes_ -= size_bytes(*oldest->second);
    surfaces_.erase(oldest);
    by_age_.pop_front();
  }
}

}  // namespace baton
