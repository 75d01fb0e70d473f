#pragma once

#include <cstdint>
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
/// Puts the largest shares into the planes of a layer at a pixel; equal shares in the order of
/// their IDs' bits. Sorts `shares`. film must have the channels.
void write_cryptomatte(FilmTile& film, const std::vector<std::string>& channels, std::size_t pixel,
                       std::vector<CryptoShare>& shares);

/// Makes a layer of `film`, if it has it, the mean of itself and of `earlier`, which counts
/// `weight` times.
void merge_cryptomatte(const FilmTile& earlier, double weight,
                       const std::vector<std::string>& channels, FilmTile& film);

/// The header attributes of a layer: name, hash, conversion, and the manifest of these names.
ImageMetadata cryptomatte_metadata(std::string_view layer, const std::vector<std::string>& names);

}  // namespace baton
