#include "worker/scene/plate.h"

#include <fmt/format.h>

#include <cstdint>

#include "common/base/files.h"
#include "common/image/averaged_down.h"
#include "worker/texture/texture.h"

namespace baton {
namespace {

/// Any picture, linear.
Result<RgbImage> read_picture(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".exr" || extension == ".hdr") return read_rgb_image(path);
  BATON_ASSIGN(const Image image, read_image(path));
  return RgbImage{image.width, image.height, linear_colors(image)};
}

}  // namespace

Result<RgbImage> load_plate(const JobSpec& job, int frame_number) {
  const std::string path = file_at(*job.output.plate, frame_number);
  BATON_ASSIGN(RgbImage plate, read_picture(path));

  // Its height at the picture's width, to a pixel.
  const int width = job.image.width, height = job.image.height;
  const std::int64_t excess =
      std::int64_t{plate.height} * width - std::int64_t{height} * plate.width;
  const bool fits = plate.width >= width && plate.height >= height && excess < plate.width &&
                    -excess < plate.width;
  if (!fits) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: expected a plate of the picture's {} x {} pixels or of that "
                             "shape and larger, got {} x {}",
                             path, width, height, plate.width, plate.height)};
  }
  if (plate.width == width && plate.height == height) return plate;
  return averaged_down(plate, width, height);
}

}  // namespace baton
