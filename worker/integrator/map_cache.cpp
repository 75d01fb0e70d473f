#include "worker/integrator/map_cache.h"

#include <algorithm>

#include "common/base/limits.h"
#include "worker/scene/map_reduction.h"

namespace baton {

Result<MapCache::MapPtr> MapCache::get(const std::string& path, const EnvironmentSpec& environment,
                                       bool compensate) {
  const Key key{path, environment.filter, environment.scale, environment.max_width, compensate};
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(maps_.begin(), maps_.end(), [&](const auto& map) { return map.first == key; });
  if (found != maps_.end()) {
    maps_.splice(maps_.begin(), maps_, found);
    return maps_.front().second;
  }
  BATON_ASSIGN(const RgbImage image, read_rgb_image(path));
  maps_.emplace_front(
      key, std::make_shared<const EnvironmentMap>(make_map(image, environment, compensate)));

  // Forget the oldest ones past the budget, never the new one.
  std::size_t total = 0;
  for (auto it = maps_.begin(); it != maps_.end();) {
    total += it->second->size_bytes();
    const bool keep = total <= limits::kMaxEnvironmentCacheBytes || it == maps_.begin();
    it = keep ? std::next(it) : maps_.erase(it);
  }
  return maps_.front().second;
}

}  // namespace baton
