#include "worker/light/map_cache.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/patiently.h"
#include "common/scene/map/map_reduction.h"

namespace baton {

Result<MapCache::MapPtr> MapCache::get(const std::string& path, const EnvironmentSpec& environment,
                                       bool compensate, const HiddenCone& hidden,
                                       float capped_share) {
  const Key key{path,   environment.filter, environment.scale, environment.max_width, compensate,
                hidden, capped_share};
  const std::lock_guard lock(reading_);
  if (MapPtr found = maps_.find(key)) return found;
  BATON_TRY(patiently([&] { return expect_room(path, environment.max_width); }));
  const auto read = [&]() -> Result<RgbImage> {
    BATON_ASSIGN(RgbImage image, read_(path));
    BATON_TRY(is_unchanged_(path));
    return image;
  };
  BATON_ASSIGN(const RgbImage image, patiently(read));
  reports_.insert_or_assign({path, environment.scale},
                            report_map(path, image, environment.scale, environment.max_width));
  return maps_.insert(key, std::make_shared<const EnvironmentMap>(
                               make_map(image, environment, compensate, hidden, capped_share)));
}

/// By the header: what a decoder, its colours and the map itself take of each texel, as measured.
Status MapCache::expect_room(const std::string& path, int max_width) const {
  constexpr std::int64_t kBytesRead = 28, kBytesKept = 16;
  if (most_bytes_ == 0) return {};
  BATON_ASSIGN(const std::int64_t texels, count_pixels(path));
  const std::int64_t kept =
      max_width > 0 ? std::min<std::int64_t>(texels, std::int64_t{max_width} * max_width / 2)
                    : texels;
  const auto bytes = static_cast<std::uint64_t>(texels * kBytesRead + kept * kBytesKept);
  if (bytes <= most_bytes_) return {};
  return Error{
      ErrorKind::bad_input,
      fmt::format("{}: {:.1f} million pixels take some {} MiB until they are a map; this "
                  "worker may use {} MiB in all (--memory): give it more, or the job a "
                  "smaller map",
                  path, 1e-6 * static_cast<double>(texels), bytes >> 20, most_bytes_ >> 20)};
}

MapReport MapCache::report(const std::string& path, float scale) const {
  const std::lock_guard lock(reading_);
  const auto found = reports_.find({path, scale});
  return found == reports_.end() ? MapReport() : found->second;
}

}  // namespace baton
