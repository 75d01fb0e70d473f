#include "worker/scene/plate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/base/check.h"
#include "common/base/files.h"
#include "worker/texture/image_reader.h"

namespace baton {
namespace {

/// Any image but EXR and HDR, whose alpha is the last of two or four channels.
Result<RgbImage> read_integers(const std::string& path) {
  BATON_ASSIGN(const Image image, read_image(path));
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t step = channels < 3 ? 0 : 1;
  RgbImage rgb{image.width, image.height, {}};
  rgb.rgb.reserve(image.samples.size() / channels * 3);
  for (std::size_t i = 0; i < image.samples.size(); i += channels) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float v = image.samples[i + c * step];
      rgb.rgb.push_back(image.is_integer ? linear_from_srgb(v) : v);
    }
  }
  return rgb;
}

/// One row of `from` samples, `step` floats apart, as `to` means; sums: (to).
void average_row(const float* row, std::int64_t from, std::int64_t to, std::size_t step,
                 std::vector<double>& sums) {
  std::fill(sums.begin(), sums.end(), 0.0);
  // In units of 1 / (from to) sample i is [i to, (i + 1) to), mean k is [k from, (k + 1) from).
  for (std::int64_t i = 0, k = 0; i < from; ++i) {
    const double value = row[static_cast<std::size_t>(i) * step];
    for (std::int64_t begin = i * to; begin < (i + 1) * to;) {
      const std::int64_t end = std::min((i + 1) * to, (k + 1) * from);
      sums[static_cast<std::size_t>(k)] +=
          value * static_cast<double>(end - begin) / static_cast<double>(from);
      begin = end;
      if (end == (k + 1) * from) ++k;
    }
  }
}

}  // namespace

RgbImage averaged_down(const RgbImage& image, int width, int height) {
  BATON_CHECK(width > 0 && width <= image.width && height > 0 && height <= image.height);
  if (width == image.width && height == image.height) return image;
  const auto old_width = static_cast<std::size_t>(image.width);
  const auto old_height = static_cast<std::size_t>(image.height);
  const auto new_width = static_cast<std::size_t>(width);
  const auto new_height = static_cast<std::size_t>(height);

  std::vector<float> narrow(new_width * old_height * 3);
  std::vector<double> sums(new_width);
  for (std::size_t y = 0; y < old_height; ++y) {
    for (std::size_t c = 0; c < 3; ++c) {
      average_row(&image.rgb[y * old_width * 3 + c], image.width, width, 3, sums);
      for (std::size_t x = 0; x < new_width; ++x)
        narrow[(y * new_width + x) * 3 + c] = static_cast<float>(sums[x]);
    }
  }
  RgbImage result{width, height, std::vector<float>(new_width * new_height * 3)};
  sums.resize(new_height);
  for (std::size_t x = 0; x < new_width * 3; ++x) {
    average_row(&narrow[x], image.height, height, new_width * 3, sums);
    for (std::size_t y = 0; y < new_height; ++y)
      result.rgb[y * new_width * 3 + x] = static_cast<float>(sums[y]);
  }
  return result;
}

Result<RgbImage> load_plate(const JobSpec& job, int frame_number) {
  const std::string path = file_at(*job.output.plate, frame_number);
  const std::string extension = lower_extension(path);
  const bool has_floats = extension == ".exr" || extension == ".hdr";
  BATON_ASSIGN(const RgbImage plate, has_floats ? read_rgb_image(path) : read_integers(path));

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
  return averaged_down(plate, width, height);
}

}  // namespace baton
