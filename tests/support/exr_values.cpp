// exr_values FILE CHANNEL: every pixel of one channel, one row of the image a line.

#include <fmt/format.h>

#include <algorithm>

#include "common/image/image_io.h"

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const baton::Result<baton::FilmTile> image = baton::read_exr(argv[1]);
  if (!image) {
    fmt::print(stderr, "{}\n", image.error().message);
    return 1;
  }
  const float* const plane = image->find(argv[2]);
  if (plane == nullptr) {
    fmt::print(stderr, "{}: no channel {}, it has {}\n", argv[1], argv[2],
               fmt::join(image->channels, " "));
    return 1;
  }
  for (std::int32_t y = 0; y < image->rect.height(); ++y) {
    const float* const row = plane + std::ptrdiff_t{y} * image->rect.width();
    fmt::print("{}\n", fmt::join(row, row + image->rect.width(), " "));
  }
  return 0;
}
