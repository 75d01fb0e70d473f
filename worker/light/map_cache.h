#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "common/base/lru_cache.h"
#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/scene/map/map_report.h"
#include "worker/surface/environment.h"

namespace baton {

/// Maps of files, as large as jobs want them, with sampling tables, kept while memory allows. Any
/// number of threads and jobs may ask; a map is read once while the others wait. Files are taken to
/// keep their contents as long as the cache lives.
class MapCache {
 public:
  using MapPtr = std::shared_ptr<const EnvironmentMap>;

  explicit MapCache(const MemorySharePtr& share)
      : maps_(share, [](const EnvironmentMap& map) { return map.size_bytes(); }) {}

  /// The map of a file with the size and table that `environment` and the other arguments, those
  /// of EnvironmentMap, ask for. Error: a map that cannot be read.
  Result<MapPtr> get(const std::string& path, const EnvironmentSpec& environment, bool compensate,
                     const HiddenCone& hidden = {}, float capped_share = 0);
  /// What is known of a map that was got with this scale; nothing of a map that was not.
  MapReport report(const std::string& path, float scale) const;

 private:
  struct Key {
    std::string path;
    MapFilter filter;
    float scale;
    int max_width;
    bool compensate;
    HiddenCone hidden;
    float capped_share;

    auto operator<=>(const Key&) const = default;
  };

  mutable std::mutex reading_;
  LruCache<Key, EnvironmentMap> maps_;
  std::map<std::pair<std::string, float>, MapReport> reports_;  ///< by path and scale
};

}  // namespace baton
