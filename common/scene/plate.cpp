#include "common/scene/plate.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "common/base/files.h"
#include "common/image/averaged_down.h"
#include "common/scene/texture/texture.h"

namespace baton {
namespace {

/// Any picture, linear.
Result<RgbImage> read_plate_image(const std::string& path, const PixelLimit& limit) {
  if (is_radiance_file(path)) return read_rgb_image(path, ExrWindow::display, limit);
  BATON_ASSIGN(const Image image, read_image(path, limit));
  return RgbImage{image.width, image.height, linear_colors(image), image.notes};
}

/// Sets what is no number to 0, before means are taken; so many pixels had some.
std::uint64_t repair(RgbImage& image) {
  std::uint64_t repaired = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    bool is_sound = true;
    for (float& v : std::span(image.rgb).subspan(i, 3)) {
      if (std::isfinite(v)) continue;
      v = 0;
      is_sound = false;
    }
    repaired += is_sound ? 0 : 1;
  }
  return repaired;
}

}  // namespace

Result<Plate> load_plate(const JobSpec& job, FrameNumber frame, const PixelLimit& limit) {
  const std::string path = file_at(*job.output.plate, frame);
  BATON_ASSIGN(RgbImage plate, read_plate_image(path, limit));
  const std::uint64_t repaired = repair(plate);

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
  std::vector<std::string> notes = std::move(plate.notes);
  if (plate.width != width || plate.height != height) plate = averaged_down(plate, width, height);
  return Plate{std::move(plate), repaired, std::move(notes)};
}

bool is_radiance_file(const std::string& path) {
  const std::string extension = lower_extension(path);
  return extension == ".exr" || extension == ".hdr";
}

std::vector<std::string> plate_notes(const std::string& path, const Plate& plate) {
  std::vector<std::string> notes;
  for (const std::string& note : plate.notes) notes.push_back(fmt::format("{}: {}", path, note));
  if (plate.repaired > 0)
    notes.push_back(
        fmt::format("{}: {} pixels are NaN or infinite and count as 0", path, plate.repaired));
  return notes;
}

}  // namespace baton
