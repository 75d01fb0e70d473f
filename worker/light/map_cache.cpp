#include "worker/light/map_cache.h"

#include "common/base/patiently.h"
#include "common/base/trace.h"
#include "common/scene/map/map_reduction.h"

namespace baton {

Result<MapCache::MapPtr> MapCache::get(const std::string& path, const EnvironmentSpec& environment,
                                       bool compensate, const HiddenCone& hidden,
                                       float capped_share, const DoParts& do_parts) {
  const Key key{path,   environment.filter, environment.scale, environment.max_width, compensate,
                hidden, capped_share};
  const std::lock_guard lock(reading_);
  if (MapPtr found = maps_.find(key)) return found;
  const Span span(SpanKind::read, path);
  const auto read = [&]() -> Result<RgbImage> {
    BATON_ASSIGN(RgbImage image, read_(path));
    BATON_TRY(is_unchanged_(path));
    return image;
  };
  BATON_ASSIGN(const RgbImage image, patiently(read));
  reports_.insert_or_assign({path, environment.scale},
                            report_map(path, image, environment.scale, environment.max_width));
  return maps_.insert(key, std::make_shared<const EnvironmentMap>(make_map(
                               image, environment, compensate, hidden, capped_share, do_parts)));
}

MapReport MapCache::report(const std::string& path, float scale) const {
  const std::lock_guard lock(reading_);
  const auto found = reports_.find({path, scale});
  return found == reports_.end() ? MapReport() : found->second;
}

}  // namespace baton
