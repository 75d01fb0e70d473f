#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "common/base/limits.h"
#include "common/job/text/job_fields.h"

namespace baton {
namespace {

/// A region as x, y, width, height; four NaN: none.
std::array<double, 4> to_numbers(const std::optional<PixelRect>& region) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (!region) return {kNone, kNone, kNone, kNone};
  return {double(region->x0), double(region->y0), double(region->width()),
          double(region->height())};
}

void region_fields(JobArchive& a, ImageSpec& image) {
  std::array<double, 4> r = to_numbers(image.region);
  if (!a.numbers("region", r, {.min = 0, .max = limits::kMaxImageSide}, false)) return;
  const bool whole = std::all_of(r.begin(), r.end(), [](double n) { return n == std::floor(n); });
  if (!whole || r[2] < 1 || r[3] < 1 || r[0] + r[2] > image.width || r[1] + r[3] > image.height) {
    a.fault("region",
            fmt::format("x, y, width and height in whole pixels, inside of {} x {}", image.width,
                        image.height),
            fmt::format("[{}]", fmt::join(r, ", ")));
    return;
  }
  const auto x = static_cast<int>(r[0]), y = static_cast<int>(r[1]);
  image.region = PixelRect{x, y, x + static_cast<int>(r[2]), y + static_cast<int>(r[3])};
}

/// The pixels on the left, on top, on the right and below; four NaN: none.
void overscan_fields(JobArchive& a, ImageSpec& image) {
  const Overscan& old = image.overscan;
  std::array<double, 4> sides{double(old.left), double(old.top), double(old.right),
                              double(old.bottom)};
  if (old == Overscan{}) sides.fill(std::numeric_limits<double>::quiet_NaN());
  if (!a.numbers("overscan", sides, {.min = 0, .max = limits::kMaxOverscan}, true)) return;
  const bool whole =
      std::all_of(sides.begin(), sides.end(), [](double n) { return n == std::floor(n); });
  const auto at = [&](std::size_t i) { return static_cast<int>(sides[i]); };
  if (whole) image.overscan = {at(0), at(1), at(2), at(3)};
  const PixelRect extent = image.extent();
  if (!whole || std::max(extent.width(), extent.height()) > limits::kMaxImageSide) {
    a.fault("overscan",
            fmt::format("whole pixels, and with them at most {} a side", limits::kMaxImageSide),
            fmt::format("[{}]", fmt::join(sides, ", ")));
    image.overscan = {};
  }
}

/// image.sites, 4 times that, 16 times ...
void max_sites_field(JobArchive& a, ImageSpec& image) {
  double most = image.max_sites > 0 ? image.max_sites : std::numeric_limits<double>::quiet_NaN();
  if (!a.number("maxSites", most, {.min = 1, .max = limits::kMaxFineSites})) return;
  std::vector<int> choices;
  for (int n = image.sites; n <= limits::kMaxFineSites; n *= 4) choices.push_back(n);
  const auto found = std::ranges::find(choices, most);
  if (found != choices.end()) {
    image.max_sites = *found;
  } else {
    a.fault("maxSites", fmt::format("one of {}", fmt::join(choices, ", ")),
            fmt::format("{}", most));
  }
}

}  // namespace

void fields(JobArchive& a, ImageSpec& image) {
  a.integer("width", image.width, 1, limits::kMaxImageSide);
  a.integer("height", image.height, 1, limits::kMaxImageSide);
  if (a.integer("sites", image.sites, 1, limits::kMaxSites)) {
    const int root = static_cast<int>(std::lround(std::sqrt(image.sites)));
    if (root * root != image.sites)
      a.fault("sites", "one of 1, 4, 9, 16", std::to_string(image.sites));
  }
  max_sites_field(a, image);
  a.choice("filter", image.filter, kPixelFilters);
  a.integer("tileSize", image.tile_size, limits::kMinTileSize, limits::kMaxTileSize);
  region_fields(a, image);
  overscan_fields(a, image);
  a.integer("siteSeed", image.site_seed);
  // Applied where it is read: what is written is the smaller image.
  double scale = std::numeric_limits<double>::quiet_NaN();
  if (a.number("scale", scale, {.min = 0, .max = 1, .min_open = true}) && scale > 0)
    image = scaled(image, scale);
}

}  // namespace baton
