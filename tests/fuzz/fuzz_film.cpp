#include "common/image/film_tile.h"
#include "tests/fuzz/section_mending.h"

namespace baton {
namespace {

/// Compares bytes: pixels may be NaN.
void look_at(ByteView file) {
  const Result<StoredFilm> stored = decode_film_tile(file, "fuzz.btf");
  if (!stored) return;
  const Bytes bytes = encode_film_tile(stored->film, stored->origin);
  const Result<StoredFilm> again = decode_film_tile(bytes, "again.btf");
  BATON_CHECK(again.ok());
  BATON_CHECK(again->origin == stored->origin && again->film.rect == stored->film.rect);
  BATON_CHECK(encode_film_tile(again->film, again->origin) == bytes);
}

}  // namespace
}  // namespace baton

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return baton::fuzz_section_file(data, size, baton::look_at);
}
