#include "common/image/image_io.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/as_shown.h"
#include "common/image/exr_image.h"
#include "common/image/radiance.h"

namespace baton {
namespace {

enum class ImageFormat { exr, radiance, unknown };

/// By the first bytes, not by the name.
Result<ImageFormat> image_format(const std::filesystem::path& path) {
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
  if (!stamp) return Error{ErrorKind::io, fmt::format("{}: no such file", path.string())};
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4> start{};
  file.read(start.data(), start.size());
  if (file.bad() || !file.is_open())
    return Error{ErrorKind::io, fmt::format("{}: cannot read", path.string())};
  if (start == std::array{'\x76', '\x2f', '\x31', '\x01'}) return ImageFormat::exr;
  if (start[0] == '#' && start[1] == '?') return ImageFormat::radiance;
  return ImageFormat::unknown;
}

Error side_error(const std::filesystem::path& path, int width, int height) {
  return {ErrorKind::bad_input,
          fmt::format("{}: {} x {} pixels, expected 1 to {} a side", path.string(), width, height,
                      limits::kMaxEnvironmentSide)};
}

bool sides_ok(int width, int height) {
  return width >= 1 && height >= 1 && width <= limits::kMaxEnvironmentSide &&
         height <= limits::kMaxEnvironmentSide;
}

/// Pixels as they are stored, as linear Rec. 709.
Result<RgbImage> converted(const std::filesystem::path& path, RgbImage image,
                           const ImageColors& colors) {
  const Status done = convert_to_rec709(image.rgb, 3, colors);
  if (!done) return Error{done.error().kind, path.string() + ": " + done.error().message};
  return image;
}

/// Grey has nothing to convert.
ImageColors colors_of(const ExrImage& exr) {
  const bool has_colors = exr.num_colors() > 1 && exr.chromaticities;
  return {.chromaticities = has_colors ? *exr.chromaticities : Chromaticities()};
}

Result<RgbImage> rgb_from_exr(const std::filesystem::path& path, ExrWindow window,
                              const PixelLimit& limit) {
  BATON_ASSIGN(ExrImage exr, read_exr_image(path, window, false, limit));
  RgbImage image{exr.width, exr.height, {}, std::move(exr.notes)};
  if (!sides_ok(image.width, image.height)) return side_error(path, image.width, image.height);

  // A single colour is all three; one that is missing is 0.
  const auto channels = static_cast<std::size_t>(exr.channels);
  const auto colors = static_cast<std::size_t>(exr.num_colors());
  const std::size_t num_pixels = exr.samples.size() / channels;
  image.rgb.resize(num_pixels * 3);
  for (std::size_t i = 0; i < num_pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t from = colors == 1 ? 0 : c;
      image.rgb[i * 3 + c] = from < colors ? exr.samples[i * channels + from] : 0.0f;
    }
  }
  return converted(path, std::move(image), colors_of(exr));
}

Result<RgbImage> rgb_from_radiance(const std::filesystem::path& path, const PixelLimit& limit) {
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxAssetFileBytes));
  BATON_ASSIGN(const RadianceHeader header, read_radiance_header(bytes, path.string()));
  if (!sides_ok(header.width, header.height)) return side_error(path, header.width, header.height);
  BATON_TRY(limit.check(header.width, header.height, path.string()));
  BATON_ASSIGN(RgbImage image, read_radiance_pixels(bytes, header, path.string()));
  image.notes = header.notes;
  return converted(path, std::move(image), header.colors);
}

std::uint8_t channel_to_srgb8(float linear) {
  return static_cast<std::uint8_t>(encode_srgb(linear) * 255.0f + 0.5f);
}

}  // namespace

Result<RgbImage> read_rgb_image(const std::filesystem::path& path, ExrWindow window,
                                const PixelLimit& limit) {
  BATON_ASSIGN(const ImageFormat format, image_format(path));
  switch (format) {
    case ImageFormat::exr:
      return rgb_from_exr(path, window, limit);
    case ImageFormat::radiance:
      return rgb_from_radiance(path, limit);
    case ImageFormat::unknown:
      break;
  }
  return Error{ErrorKind::bad_input,
               fmt::format("{}: neither an EXR nor a Radiance HDR picture", path.string())};
}

Result<ImageColors> read_image_colors(const std::filesystem::path& path) {
  BATON_ASSIGN(const ImageFormat format, image_format(path));
  if (format == ImageFormat::exr) return read_exr_image_colors(path);
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxAssetFileBytes));
  BATON_ASSIGN(const RadianceHeader header, read_radiance_header(bytes, path.string()));
  return header.colors;
}

std::vector<std::uint8_t> to_srgb8(const RgbImage& image) {
  BATON_CHECK(image.width > 0 && image.height > 0);
  BATON_CHECK(image.rgb.size() == static_cast<std::size_t>(image.width) * image.height * 3);
  std::vector<std::uint8_t> pixels(image.rgb.size());
  std::ranges::transform(image.rgb, pixels.begin(), channel_to_srgb8);
  return pixels;
}

Status write_png(const std::filesystem::path& path, const RgbImage& image) {
  const std::vector<std::uint8_t> pixels = to_srgb8(image);

  // Encode in memory, then publish.
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  png.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  Bytes encoded(size);
  if (png_image_write_to_memory(&png, encoded.data(), &size, 0, pixels.data(), 0, nullptr) == 0) {
    return Error{ErrorKind::internal,
                 fmt::format("{}: cannot be encoded as PNG: {}", path.string(), png.message)};
  }
  encoded.resize(size);
  return write_file_atomic(path, encoded);
}

}  // namespace baton
