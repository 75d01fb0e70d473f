#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/image/channel_names.h"
#include "common/image/color_space.h"
#include "common/image/exr_channels.h"
#include "common/image/film_tile.h"
#include "common/image/pixel_limit.h"

namespace baton {

/// Interleaved linear RGB float32, row 0 on top.
struct RgbImage {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< (height, width, 3)
  /// What a person should know of the file that was read, a line each: a choice, what counts as
  /// unknown.
  std::vector<std::string> notes{};
};

/// Reads an EXR or Radiance HDR image as float32 RGB (grey is spread to three channels, alpha
/// dropped), in linear Rec. 709 as the header says what its numbers are (read_image_colors).
/// window: of an EXR file. Errors name the file: missing, not an image, truncated, sides past
/// limits::kMaxEnvironmentSide, more pixels than `limit` has, no colours (color_choice.h).
Result<RgbImage> read_rgb_image(const std::filesystem::path& path,
                                ExrWindow window = ExrWindow::display,
                                const PixelLimit& limit = {});
/// What read_rgb_image converts from: `chromaticities` of an EXR file; PRIMARIES, EXPOSURE and
/// COLORCORR of a Radiance one. Of an image of one channel, only factors.
Result<ImageColors> read_image_colors(const std::filesystem::path& path);

/// Header attribute of an EXR file.
using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

struct ExrOptions {
  bool half_float = true;            ///< all channels but `whole`
  std::vector<std::string> whole{};  ///< channels that are float32 always
  std::string compression = "zip";   ///< none, rle, zips, zip, piz
  ImageMetadata metadata{};
  /// Attributes of their own, which compositors read: worldToCamera, worldToNDC (row by row; points
  /// are row vectors), framesPerSecond.
  std::optional<std::array<float, 16>> world_to_camera{}, world_to_ndc{};
  std::optional<double> frames_per_second{};
  /// With frames_per_second, if that is a whole number that SMPTE counts (up to 30): timeCode,
  /// frame 0 at 00:00:00:00, modulo a day.
  std::optional<int> frame_number{};
  ChannelNaming naming = ChannelNaming::plain;  ///< in the file
  /// What is shown, in pixels of the image, with its corner at (0, 0); none: all.
  std::optional<PixelRect> display_window{};
  Chromaticities chromaticities{};  ///< those of R, G and B; written always
};

/// All channels of `image`, whose rectangle is the data window, as one scan-line EXR file in
/// memory; `name` goes first in every error. Bytes are deterministic (no dates, no host names).
/// Values past half's largest, 65504, stop there in half channels. Errors: unknown compression, a
/// metadata key twice.
Result<Bytes> encode_exr(const std::string& name, const FilmTile& image, const ExrOptions& options);
/// Publishes the encoded file atomically, with missing folders. Errors: encode_exr's, the disk.
Status write_exr(const std::filesystem::path& path, const FilmTile& image,
                 const ExrOptions& options);
/// Reads every channel of a flat EXR file as float32, by its plain name (channel_names.h), in
/// alphabetical order. The rectangle is that of the pixels in the file's coordinates. Errors name
/// the file: missing, not an EXR, truncated, subsampled channels, past the limits of image sides.
Result<FilmTile> read_exr(const std::filesystem::path& path, ExrWindow window = ExrWindow::data);
/// Rows y0 to y1 - 1 of every channel, clipped to the data window. Errors: read_exr's, a file whose
/// table of blocks has gaps.
Result<FilmTile> read_exr_rows(const std::filesystem::path& path, int y0, int y1);
/// Metadata of an EXR file that `write_exr` made: attributes that are texts, 4x4 matrices (16
/// numbers row by row), rational numbers (n/d) or time codes (hours:minutes:seconds:frames).
Result<ImageMetadata> read_exr_metadata(const std::filesystem::path& path);

/// 8-bit sRGB from linear RGB [IEC 61966-2-1], (height, width, 3); values outside [0, 1] are
/// clamped, NaN is 0.
std::vector<std::uint8_t> to_srgb8(const RgbImage& image);
/// PNG of to_srgb8, published atomically.
Status write_png(const std::filesystem::path& path, const RgbImage& image);

}  // namespace baton
