#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "common/base/lru_cache.h"
#include "common/base/result.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"
#include "common/scene/map/map_report.h"
#include "worker/surface/environment.h"

namespace baton {

/// Maps of files, as large as jobs want them, with sampling tables, kept while memory allows. Any
/// number of threads and jobs may ask; a map is read once while the others wait.
class MapCache {
 public:
  using MapPtr = std::shared_ptr<const EnvironmentMap>;

  using Reader = std::function<Result<RgbImage>(const std::string& path)>;
  /// Of files of at most so many pixels.
  static Reader read_within(PixelLimit limit) {
    return [limit = std::move(limit)](const std::string& path) {
      return read_rgb_image(path, ExrWindow::display, limit);
    };
  }

  explicit MapCache(const MemorySharePtr& share, Reader read = read_within({}))
      : read_(std::move(read)),
        maps_(share, [](const EnvironmentMap& map) { return map.size_bytes(); }) {}

  /// is_unchanged: asked of each file once it is read: an error says that it is not the one that is
  /// meant. Before the first get().
  void check_with(std::function<Status(const std::string& path)> is_unchanged) {
    is_unchanged_ = std::move(is_unchanged);
  }
  /// The map of a file with the size and table that `environment` and the other arguments, those
  /// of EnvironmentMap, ask for. A disk that is away for a moment is waited for. Error: a map that
  /// cannot be read, is too large, or has changed.
  Result<MapPtr> get(const std::string& path, const EnvironmentSpec& environment, bool compensate,
                     const HiddenCone& hidden = {}, float capped_share = 0,
                     const DoParts& do_parts = do_in_turn);
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

  const Reader read_;
  std::function<Status(const std::string& path)> is_unchanged_ = [](const auto&) {
    return Status();
  };
  mutable std::mutex reading_;
  LruCache<Key, EnvironmentMap> maps_;
  std::map<std::pair<std::string, float>, MapReport> reports_;  ///< by path and scale
};

}  // namespace baton
