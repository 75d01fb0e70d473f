#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/job/time.h"
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
  /// The plane of a channel by its name; null when there is none.
  float* find(std::string_view channel);
  const float* find(std::string_view channel) const;
};

/// The pixels of a film that lie in `rect`, which it contains.
FilmTile part_of(const FilmTile& film, const PixelRect& rect);
/// The film as `rect` frames it: its pixels inside, 0 where it has none.
FilmTile framed(const FilmTile& film, const PixelRect& rect);

/// A black image.
FilmTile blank_image(const PixelRect& rect, std::vector<std::string> channels);
/// Copies the pixels of `tile` into `image`. Error when the channels differ or the tile leaves the
/// image.
Status paste_tile(const FilmTile& tile, FilmTile& image);

/// Which pass made a film. Stored; values are for ever.
enum class FilmPass : std::uint8_t { first = 0, second = 1 };

/// Where a film comes from. It stands in the file so that films of equal planes, such as empty
/// tiles of two frames, are different blobs: what one task no longer needs is never what another
/// made.
struct FilmOrigin {
  Digest picture;
  Step step{};
  FilmPass pass = FilmPass::first;

  bool operator==(const FilmOrigin&) const = default;
};

/// A film file, read.
struct StoredFilm {
  FilmOrigin origin;
  FilmTile film;
};

/// Deterministic bytes for the blob store, different for every (origin, rectangle); container of
/// common/base/section_file.h.
Bytes encode_film_tile(const FilmTile& tile, const FilmOrigin& origin);
/// `name` goes first in every error: wrong magic or version, checksum, values out of range.
Result<StoredFilm> decode_film_tile(ByteView bytes, const std::string& name);

}  // namespace baton
