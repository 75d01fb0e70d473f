// exr_digest FILE...: one line a file: size, then the digest of each channel's decoded pixels.
// Headers do not count.

#include <fmt/format.h>

#include <span>

#include "common/base/digest.h"
#include "common/image/image_io.h"

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const baton::Result<baton::FilmTile> image = baton::read_exr(argv[i]);
    if (!image) {
      fmt::print(stderr, "{}\n", image.error().message);
      return 1;
    }
    fmt::print("{}x{}", image->rect.width(), image->rect.height());
    for (std::size_t channel = 0; channel < image->channels.size(); ++channel) {
      const std::span plane(image->plane(channel), image->num_pixels());
      fmt::print(" {}={}", image->channels[channel], baton::digest_of(std::as_bytes(plane)).hex());
    }
    fmt::print("\n");
  }
  return 0;
}
