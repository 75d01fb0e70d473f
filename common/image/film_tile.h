#pragma once

#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// The finished pixels of one tile of one frame: named float planes, row by row inside `rect`.
/// Channel names are EXR's: "R", "G", "B", "A", "lns", "normal.X", "source.R" ...
struct FilmTile {
  PixelRect rect;
  std::vector<std::string> channels;
  std::vector<float> values;  ///< (channels, pixels)

  bool operator==(const FilmTile&) const = default;
  std::size_t num_pixels() const { return static_cast<std::size_t>(rect.area()); }
  float* plane(std::size_t channel) { return values.data() + channel * num_pixels(); }
  const float* plane(std::size_t channel) const { return values.data() + channel * num_pixels(); }
};

/// Deterministic bytes for the blob store; container of common/base/section_file.h.
Bytes encode_film_tile(const FilmTile& tile);
Result<FilmTile> decode_film_tile(ByteView bytes, const std::string& name);

}  // namespace baton
