#include "common/image/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

enum class PictureFormat { exr, radiance, unknown };

/// By the first bytes, not by the name.
Result<PictureFormat> picture_format(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return Error{ErrorKind::io, fmt::format("{}: no such file", path.string())};
  }
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4> start{};
  file.read(start.data(), start.size());
  if (file.bad() || !file.is_open())
    return Error{ErrorKind::io, fmt::format("{}: cannot read", path.string())};
  if (start == std::array{'\x76', '\x2f', '\x31', '\x01'}) return PictureFormat::exr;
  if (start[0] == '#' && start[1] == '?') return PictureFormat::radiance;
  return PictureFormat::unknown;
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

Result<RgbImage> rgb_from_exr(const std::filesystem::path& path) {
  BATON_ASSIGN(const FilmTile film, read_exr(path));
  RgbImage image{film.rect.width(), film.rect.height(), {}};
  if (!sides_ok(image.width, image.height)) return side_error(path, image.width, image.height);

  // Find R, G and B, or the one channel that stands for all three.
  std::array<std::size_t, 3> index{};
  for (std::size_t c = 0; c < 3 && film.channels.size() > 1; ++c) {
    const std::string wanted(1, "RGB"[c]);
    const auto it = std::ranges::find(film.channels, wanted);
    if (it == film.channels.end()) {
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: no channel {} among {}, expected R, G, B or one channel",
                               path.string(), wanted, fmt::join(film.channels, ", "))};
    }
    index[c] = static_cast<std::size_t>(it - film.channels.begin());
  }

  // Interleave.
  const std::array planes{film.plane(index[0]), film.plane(index[1]), film.plane(index[2])};
  image.rgb.resize(film.num_pixels() * 3);
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.rgb[i * 3 + c] = planes[c][i];
  }
  return image;
}

Result<RgbImage> rgb_from_radiance(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: not a readable Radiance HDR file: {}", path.string(), what)};
  };
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create("hdr");
  if (!input) return fail(OIIO::geterror());
  OIIO::ImageSpec spec;
  if (!input->open(path.string(), spec)) return fail(input->geterror());
  if (!sides_ok(spec.width, spec.height)) return side_error(path, spec.width, spec.height);
  if (spec.nchannels != 3) return fail(fmt::format("{} channels, expected 3", spec.nchannels));

  // Row by row, so that memory grows only with data that is really there.
  RgbImage image{spec.width, spec.height, {}};
  const std::size_t row_values = static_cast<std::size_t>(spec.width) * 3;
  for (int y = 0; y < spec.height; ++y) {
    image.rgb.resize(image.rgb.size() + row_values);
    float* row = image.rgb.data() + image.rgb.size() - row_values;
    if (!input->read_scanline(y, 0, OIIO::TypeDesc::FLOAT, row)) {
      return fail(fmt::format("row {} of {}: {}", y, spec.height, input->geterror()));
    }
  }
  return image;
}

/// Linear [0, 1] to 8-bit sRGB [IEC 61966-2-1]; NaN gives 0.
std::uint8_t to_srgb8(float linear) {
  if (!(linear > 0)) return 0;
  const float clamped = std::min(linear, 1.0f);
  const float encoded =
      clamped <= 0.0031308f ? 12.92f * clamped : 1.055f * std::pow(clamped, 1.0f / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(encoded * 255.0f + 0.5f);
}

}  // namespace

Result<RgbImage> read_rgb_image(const std::filesystem::path& path) {
  BATON_ASSIGN(const PictureFormat format, picture_format(path));
  switch (format) {
    case PictureFormat::exr:
      return rgb_from_exr(path);
    case PictureFormat::radiance:
      return rgb_from_radiance(path);
    case PictureFormat::unknown:
      break;
  }
  return Error{ErrorKind::bad_input,
               fmt::format("{}: neither an EXR nor a Radiance HDR picture", path.string())};
}

Status write_png(const std::filesystem::path& path, const RgbImage& image) {
  BATON_CHECK(image.width > 0 && image.height > 0);
  BATON_CHECK(image.rgb.size() == static_cast<std::size_t>(image.width) * image.height * 3);
  std::vector<std::uint8_t> pixels(image.rgb.size());
  std::ranges::transform(image.rgb, pixels.begin(), to_srgb8);

  // Encode in memory, then publish.
  std::vector<unsigned char> encoded;
  OIIO::Filesystem::IOVecOutput proxy(encoded);
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("png");
  if (!output) {
    return Error{ErrorKind::internal,
                 fmt::format("{}: no PNG writer: {}", path.string(), OIIO::geterror())};
  }
  const bool written = output->set_ioproxy(&proxy) && output->open(path.string(), spec) &&
                       output->write_image(OIIO::TypeDesc::UINT8, pixels.data()) && output->close();
  if (!written) {
    return Error{ErrorKind::io, fmt::format("{}: cannot be written as PNG: {}", path.string(),
                                            output->geterror())};
  }
  return write_file_atomic(path, std::as_bytes(std::span(encoded)));
}

}  // namespace baton
