#pragma once

#include <string>
#include <string_view>

namespace baton {

/// Textures of tiles (UDIM): a file name in which kTileMark stands for the number of a tile. Tile
/// kFirstTile + i + kTileColumns j is the image on the square from (i, j) to (i + 1, j + 1) of
/// texture coordinates that count upwards from the lower left corner of the first.
inline constexpr std::string_view kTileMark = "<UDIM>";
inline constexpr int kFirstTile = 1001, kTileColumns = 10, kTileRows = 10;
inline constexpr int kNumTiles = kTileColumns * kTileRows;

/// Whether a path has the mark.
bool has_tiles(const std::string& path);
/// The file of a tile. path: has the mark.
std::string tile_file(const std::string& path, int number);

}  // namespace baton
