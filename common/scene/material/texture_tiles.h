#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "common/job/udim.h"
#include "common/scene/mesh/triangle_mesh.h"
#include "common/scene/texture/texture.h"

namespace baton {

/// The images of a texture of tiles (common/job/udim.h), in the order of their numbers.
struct TextureTiles {
  std::string file;                                                ///< with the mark
  std::array<std::shared_ptr<const Texture>, kNumTiles> images{};  ///< null: not there
};

/// A triangle in the plane of tiles, v upwards from the lower left corner of tile kFirstTile.
using TileTriangle = std::array<Uv, 3>;

/// Where in which tile a place of a triangle lies. A triangle that ends at an edge of a tile lies
/// within that tile to its end.
struct TilePlace {
  int column, row;  ///< may be outside of the tiles
  /// Place in that tile's image, (0, 0) its upper left corner.
  Uv uv;

  bool is_in_range() const {
    return column >= 0 && column < kTileColumns && row >= 0 && row < kTileRows;
  }
  std::size_t index() const { return static_cast<std::size_t>(column + kTileColumns * row); }
};
/// at: of the plane of tiles.
TilePlace tile_place(const TileTriangle& triangle, const Uv& at);

/// Why a triangle cannot have its image: it has area in a tile that is not there. nullopt: it can.
std::optional<std::string> tile_fault(const TextureTiles& tiles, const TileTriangle& triangle);

}  // namespace baton
