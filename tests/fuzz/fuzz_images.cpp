#include <cstring>

#include "common/image/image_io.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace baton {
namespace {

/// What was read as a frame is written and read once more.
void look_at_frame(FilmTile film, const ImageMetadata& metadata) {
  film.rect = {0, 0, film.rect.width(), film.rect.height()};
  const Result<Bytes> bytes =
      encode_exr("fuzz.exr", film, {.half_float = false, .metadata = metadata});
  if (!bytes) return;
  const Result<FilmTile> again = read_exr(MemoryFile(*bytes).path());
  BATON_CHECK(again.ok());
  BATON_CHECK(again->rect == film.rect && again->channels == film.channels);
  BATON_CHECK(std::memcmp(again->values.data(), film.values.data(),
                          film.values.size() * sizeof(float)) == 0);
}

}  // namespace
}  // namespace baton

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace baton;
  const MemoryFile file(fuzz_input(data, size));
  if (const Result<RgbImage> image = read_rgb_image(file.path())) {
    BATON_CHECK(image->rgb.size() == 3 * static_cast<std::size_t>(image->width) *
                                         static_cast<std::size_t>(image->height));
  }
  static_cast<void>(read_exr_rows(file.path(), 1, 3).ok());
  const Result<FilmTile> film = read_exr(file.path());
  const Result<ImageMetadata> metadata = read_exr_metadata(file.path());
  if (film && metadata) look_at_frame(*film, *metadata);
  return 0;
}
