#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/film_tile.h"
#include "common/image/image_io.h"

namespace baton {

/// ID mattes as compositors read them [Friedman & Jones 2015, Cryptomatte specification 1.2]: for
/// each pixel the things that it sees, as the hashes of their names, and the share of the pixel
/// that each covers, largest share first. The channels of a layer are ID and share of one thing, ID
/// and share of the next, and so on; a pixel keeps as many as there are channels for, and leaves
/// out the rest.

/// A name's ID: MurmurHash3 (x86, 32 bits, seed 0) with an exponent that makes it a normal float.
float cryptomatte_id(std::string_view name);

/// One thing in a pixel. share: (0, 1].
struct CryptoShare {
  float id = 0;
  float share = 0;
};
/// The planes of a layer in a film, which must have the channels.
class CryptoLayer {
 public:
  CryptoLayer(FilmTile& film, const std::vector<std::string>& channels);
  /// Puts the largest shares into a pixel; equal ones in the order of their IDs' bits. Sorts them.
  void write(std::size_t pixel, std::vector<CryptoShare>& shares) const;
  /// Adds the shares of a pixel, times `factor`, to sums by the bits of their IDs.
  void add_to(std::size_t pixel, double factor, std::map<std::uint32_t, double>& sums) const;

 private:
  std::vector<float*> planes_;  ///< ID, share, ID, share, ...
};

/// Makes a layer of `film`, if it has it, the mean of itself and of `earlier`, which counts
/// `weight` times.
void merge_cryptomatte(FilmTile& earlier, double weight, const std::vector<std::string>& channels,
                       FilmTile& film);

/// The header attributes of a layer: name, hash, conversion, and the manifest of these names.
ImageMetadata cryptomatte_metadata(std::string_view layer, const std::vector<std::string>& names);

}  // namespace baton
