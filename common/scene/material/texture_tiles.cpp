#include "common/scene/material/texture_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

/// Larger coordinates are outside of all tiles, and no whole numbers of int.
constexpr float kFarAway = 1000;

/// Tiles [first, last] that a stretch has length in.
struct TileRange {
  int first, last;
};
TileRange range_of(float a, float b, float c) {
  const float low = std::clamp(std::min({a, b, c}), -kFarAway, kFarAway);
  const float high = std::clamp(std::max({a, b, c}), -kFarAway, kFarAway);
  const int first = static_cast<int>(std::floor(low));
  return {first, std::max(first, static_cast<int>(std::ceil(high)) - 1)};
}
TileRange columns_of(const TileTriangle& t) { return range_of(t[0][0], t[1][0], t[2][0]); }
TileRange rows_of(const TileTriangle& t) { return range_of(t[0][1], t[1][1], t[2][1]); }

/// Whether a triangle has area in the unit square at (x, y) [separating axes]. Its bounds have.
bool overlaps(const TileTriangle& t, int x, int y) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Uv &a = t[k], &b = t[(k + 1) % 3], &c = t[(k + 2) % 3];
    const double nx = double{b[1]} - a[1], ny = double{a[0]} - b[0];
    const auto along = [&](double px, double py) { return nx * (px - a[0]) + ny * (py - a[1]); };
    const double inside = along(c[0], c[1]);
    double most = 0;
    for (const int corner : {0, 1, 2, 3})
      most = std::max(most, along(x + corner % 2, y + corner / 2) * (inside < 0 ? -1 : 1));
    if (inside != 0 && !(most > 0)) return false;
  }
  return true;
}

}  // namespace

TilePlace tile_place(const TileTriangle& triangle, const Uv& at) {
  const TileRange columns = columns_of(triangle), rows = rows_of(triangle);
  const auto within = [](float v, const TileRange& range) {
    const float first = static_cast<float>(range.first), last = static_cast<float>(range.last);
    return static_cast<int>(v >= first ? std::min(std::floor(v), last) : first);
  };
  const int column = within(at[0], columns), row = within(at[1], rows);
  return {column, row, {at[0] - static_cast<float>(column), static_cast<float>(row + 1) - at[1]}};
}

std::optional<std::string> tile_fault(const TextureTiles& tiles, const TileTriangle& triangle) {
  const TileRange columns = columns_of(triangle), rows = rows_of(triangle);
  const bool is_inside =
      columns.first >= 0 && columns.last < kTileColumns && rows.first >= 0 && rows.last < kTileRows;
  if (!is_inside)
    return fmt::format("has texture coordinates outside of the tiles {} to {} of {}", kFirstTile,
                       kFirstTile + kNumTiles - 1, tiles.file);
  for (int row = rows.first; row <= rows.last; ++row) {
    for (int column = columns.first; column <= columns.last; ++column) {
      if (!overlaps(triangle, column, row)) continue;
      const TilePlace place{column, row, {}};
      if (tiles.images[place.index()] == nullptr)
        return fmt::format("needs {}, which is missing",
                           tile_file(tiles.file, kFirstTile + static_cast<int>(place.index())));
    }
  }
  return std::nullopt;
}

}  // namespace baton
